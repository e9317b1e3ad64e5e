#include "host/passes/vulkan_solid_backend.h"

#include "backend/cpu_backend.h"
#include "core/stopwatch.h"
#include "host/passes/cell_pass.h"
#include "host/passes/device_backend.h"
#include "host/passes/polyhedra_pass.h"
#include "host/passes/surface_stage.h"

namespace bisector::host {
namespace {

Box box_of(const Solid& solid) {
  std::vector<Vec3> points(solid.enclosure.begin(), solid.enclosure.end());
  points.insert(points.end(), {solid.box.lo, solid.box.hi});
  return bounding_box(points);
}

class VulkanSolidBackend : public DeviceBackend<SolidBackend, CpuSolidBackend> {
 public:
  VulkanSolidBackend(const Solid& solid, std::shared_ptr<Device> device, const VulkanOptions& options,
                     const Precisions& precisions, InnerCells inner);

 private:
  DeviceWork compute_on_device(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override;
  void find_owners(const std::vector<Vec3>& seeds);
  void find_boundary_moments(CellMoments& boundary, Certification& certification);
  void find_moments(CellMoments& moments, Certification& certification);
  PairJob job() {
    return {stage_.commands, stage_.seeds, stage_.neighbours, stage_.scan, stage_.counters, store_, tets_};
  }

  // The solid's boundary.
  SurfaceStage shell_;
  CellPass shell_cells_;
  // Its inside.
  DeviceSolid device_solid_;
  OwnerPass corners_;
  TetPairs tets_;
  PairPass pairs_;
  PairStore store_;
  CellPass cells_;
  PolyhedraPass polyhedra_;
};

VulkanSolidBackend::VulkanSolidBackend(const Solid& solid, std::shared_ptr<Device> device, const VulkanOptions& options,
                                       const Precisions& precisions, InnerCells inner)
    : DeviceBackend(solid, std::move(device), precisions, options.neighbours, device_scale(solid), box_of(solid), true,
                    inner),
      shell_(stage_, solid.boundary, options.capacities), shell_cells_(stage_.device(), stage_.is_double(), false),
      device_solid_(stage_.device(), stage_.commands, solid, stage_.seeds.scale, stage_.is_double(),
                    precisions.double_rung),
      corners_(stage_.device(), stage_.is_double()),
      tets_(stage_.is_double(), device_solid_, corners_, stage_.exact,
            inner == InnerCells::whole && solid.density.empty(), options.capacities.batch_pairs),
      pairs_(stage_.device(), stage_.is_double(), options.capacities), store_(stage_.device()),
      cells_(stage_.device(), stage_.is_double(), true), polyhedra_(stage_.device()) {
  std::vector<Index> triangles, places;
  for (const FacetSummary& summary : solid.boundary.summaries) triangles.push_back(summary.triangle);
  shell_cells_.set_elements(stage_.commands, triangles, solid.boundary.facet_of.size());
  // The enclosure's pairs come last.
  for (Index t = 0; t <= device_solid_.enclosure(); ++t) places.push_back(t);
  cells_.set_elements(stage_.commands, places, places.size());
  std::vector<Vec3> points;
  for (const Index v : device_solid_.vertices) points.push_back(solid.mesh.vertices[v]);
  corners_.set_points(stage_.commands, points, stage_.seeds.scale);
  stage_.commands.run();
}

DeviceWork VulkanSolidBackend::compute_on_device(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) {
  CellMoments& moments = diagram.moments;
  DeviceWork work;
  Stopwatch watch;
  find_owners(seeds);
  work.searched = watch.lap();

  CellMoments shell;
  find_boundary_moments(shell, work.certification);
  if (includes(want, Want::labels)) shell_.polygons(diagram.polygons);
  tets_.set_shell(shell_.store(), shell, stage_.seeds.count());
  work.paired = watch.lap();

  find_moments(moments, work.certification);
  moments.triangles = std::move(shell.triangles);
  stage_.set_step_masses(moments);
  work.clipped = watch.lap();
  if (includes(want, Want::polyhedra)) polyhedra_.run(pairs_, job(), tets_, stage_.exact, diagram.polyhedra);
  return work;
}

void VulkanSolidBackend::find_owners(const std::vector<Vec3>& seeds) {
  shell_.find_owners(seeds);
  if (stage_.sorted_anew()) corners_.forget();
  stage_.commands.fill(stage_.counters, kUncertainOwners * sizeof(uint), sizeof(uint), 0);
  corners_.record(stage_.commands, stage_.seeds, stage_.neighbours.grid(), stage_.counters, true);
  const Counters counters = stage_.run_counted();
  corners_.complete(stage_.commands, counters[kUncertainOwners], stage_.exact);
}

void VulkanSolidBackend::find_boundary_moments(CellMoments& boundary, Certification& certification) {
  shell_.find_pairs(certification);
  shell_cells_.sort(stage_.commands, stage_.seeds.count(), stage_.scan, shell_.store());
  shell_cells_.sum(stage_, shell_.store(), boundary);
}

void VulkanSolidBackend::find_moments(CellMoments& moments, Certification& certification) {
  pairs_.run(job(), certification);
  cells_.sort(stage_.commands, stage_.seeds.count(), stage_.scan, store_);
  const auto sum = [&] { cells_.sum(stage_, store_, moments); };
  sum();
  if (!stage_.is_double()) {
    const auto refine = [&](float share) { return pairs_.refine(job(), cells_.cells(), share, certification); };
    refine_masses(mass(), moments, refine, sum);
  }
  certification.pairs = moments.triangles.values.size();
}

}  // namespace

std::unique_ptr<SolidBackend> make_vulkan_solid_backend(const Solid& solid, std::shared_ptr<Device> device,
                                                        const VulkanOptions& options, InnerCells inner) {
  const Precisions precisions = choose_precisions(*device, options.precision, options.double_rung);
  return std::make_unique<VulkanSolidBackend>(solid, std::move(device), options, precisions, inner);
}

}  // namespace bisector::host
