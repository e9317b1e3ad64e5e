#include "host/passes/vulkan_solid_backend.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "backend/cpu_backend.h"
#include "core/stopwatch.h"
#include "host/passes/boundary_pass.h"
#include "host/passes/cell_pass.h"
#include "host/passes/device_backend.h"
#include "host/passes/polyhedra_pass.h"
#include "host/passes/surface_stage.h"
#include "voronoi/polyhedra.h"
#include "voronoi/totals.h"

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
                     const Precisions& precisions, SolidCells how);

 private:
  DiagramWorkOnDevice compute_on_device(Want want, Diagram& diagram) override;
  void learn_speed(std::size_t pairs, double seconds) override {
    shell_.learn_speed(pairs, seconds);
    pairs_.learn_speed(pairs, seconds);
  }
  void find_owners();
  void find_pairs(Certification& certification);
  void list_triangles(Csr<Index>& triangles);
  void find_moments(CellMoments& moments, Certification& certification);
  void add_boundary(CellMoments& moments);
  void append_boundary(ClippedPolyhedra& polyhedra);
  PairJob job() { return {stage_.commands, stage_.seeds, stage_.neighbours, stage_.counters, store_, tets_}; }

  const bool whole_;  // cells are not cut up
  // The solid's boundary.
  SurfaceStage shell_;
  CellPass shell_cells_;
  // Its inside.
  DeviceSolid device_solid_;
  BoundaryPass boundary_;  // for whole cells
  OwnerPass corners_;      // for cells that are cut up
  TetPairs tets_;
  PairPass pairs_;
  PairStore store_;
  CellPass cells_;
  PolyhedraPass polyhedra_;
};

VulkanSolidBackend::VulkanSolidBackend(const Solid& solid, std::shared_ptr<Device> device, const VulkanOptions& options,
                                       const Precisions& precisions, SolidCells how)
    : DeviceBackend(solid, std::move(device), precisions, options, device_scale(solid), box_of(solid), true, how),
      whole_(how == SolidCells::whole && solid.density.empty()), shell_(stage_, solid.boundary, options.capacities),
      shell_cells_(stage_.device(), stage_.is_double(), false),
      device_solid_(stage_.device(), stage_.commands, solid, whole_, stage_.seeds.scale, stage_.is_double(),
                    precisions.double_rung),
      boundary_(solid, device_solid_.frames.back()), corners_(stage_.device(), stage_.is_double()),
      tets_(stage_.is_double(), device_solid_, corners_, stage_.exact,
            batch_pairs_of(stage_.device(), options.capacities.batch_pairs)),
      pairs_(stage_.device(), stage_.is_double(), options.capacities), store_(stage_.device()),
      cells_(stage_.device(), stage_.is_double(), true), polyhedra_(stage_.device()) {
  std::vector<Index> places(device_solid_.frames.size());
  std::iota(places.begin(), places.end(), Index{0});
  cells_.set_elements(stage_.commands, places, places.size());
  if (!whole_) {
    std::vector<Index> triangles;
    for (const FacetSummary& summary : solid.boundary.summaries) triangles.push_back(summary.triangle);
    shell_cells_.set_elements(stage_.commands, triangles, solid.boundary.facet_of.size());
    std::vector<Vec3> points;
    for (const Index v : device_solid_.vertices) points.push_back(solid.mesh.vertices[v]);
    corners_.set_points(stage_.commands, points, stage_.seeds.scale);
  }
  stage_.commands.run();
}

DiagramWorkOnDevice VulkanSolidBackend::compute_on_device(Want want, Diagram& diagram) {
  CellMoments& moments = diagram.moments;
  DiagramWorkOnDevice work;
  Stopwatch watch;
  find_owners();
  work.searched = watch.lap();

  shell_.find_pairs(work.certification);
  Csr<Index> triangles;
  if (whole_) {
    shell_.polygons(includes(want, Want::polygons), diagram.polygons);
    boundary_.run(stage_.seeds.on_host(), stage_.exact.neighbours(), diagram.polygons, includes(want, Want::polyhedra));
    triangles = boundary_.triangles();
  } else {
    list_triangles(triangles);
    if (includes(want, Want::labels)) shell_.polygons(includes(want, Want::polygons), diagram.polygons);
    tets_.plan(stage_.seeds.count());
  }
  work.paired = watch.lap();

  find_moments(moments, work.certification);
  moments.triangles = std::move(triangles);
  stage_.complete_step_masses(moments);
  work.clipped = watch.lap();
  if (includes(want, Want::polyhedra)) {
    polyhedra_.run(pairs_, job(), tets_, stage_.exact, diagram.polyhedra);
    if (whole_) append_boundary(diagram.polyhedra);
  }
  return work;
}

void VulkanSolidBackend::find_owners() {
  shell_.find_owners();
  if (whole_) return;
  if (stage_.sorted_anew()) corners_.forget();
  stage_.commands.fill(stage_.counters, kUncertainOwners * sizeof(uint), sizeof(uint), 0);
  corners_.record(stage_.commands, stage_.seeds, stage_.neighbours.tree(), stage_.counters, true);
  const Counters counters = stage_.run_counted();
  corners_.complete(stage_.commands, counters[kUncertainOwners], stage_.exact);
}

void VulkanSolidBackend::find_pairs(Certification& certification) {
  if (!whole_) return pairs_.run(job(), certification);
  std::vector<Index> marks;
  do {
    tets_.plan_whole(boundary_.slots_inside(), boundary_.marks());
    pairs_.run(job(), certification);
    if (boundary_.is_settled()) return;
    marks = pairs_.marks(job());
    for (std::size_t s = 0; s < marks.size(); ++s) marks[s] |= tets_.marks()[s];
  } while (!boundary_.settle(marks));
}

void VulkanSolidBackend::list_triangles(Csr<Index>& triangles) {
  CellMoments shell;
  do shell_cells_.record(stage_, shell_.store());
  while (!shell_cells_.read(stage_, true, shell));
  triangles = std::move(shell.triangles);
}

void VulkanSolidBackend::find_moments(CellMoments& moments, Certification& certification) {
  find_pairs(certification);
  const double at_boundary = whole_ ? boundary_.mass() : 0;
  find_cells(
      stage_, cells_, store_, {mass() - at_boundary, mass()},
      [&]() -> std::optional<double> {
        if (!cells_.read(stage_, false, moments)) return {};
        return moments.mass;
      },
      [&](float share) { return pairs_.refine(job(), cells_.cells(), share, certification); });
  if (whole_) add_boundary(moments);
  certification.pairs = cells_.items() + (whole_ ? boundary_.count() : 0);
}

void VulkanSolidBackend::add_boundary(CellMoments& moments) {
  boundary_.put_moments(moments.cells);
  set_totals(moments);
  // The device's medians lack the masses at the boundary.
  std::fill(moments.step_mass.begin(), moments.step_mass.end(), -1);
}

void VulkanSolidBackend::append_boundary(ClippedPolyhedra& polyhedra) {
  const ClippedPolyhedra inner = std::move(polyhedra);
  std::vector<const ClippedPolyhedra*> parts{&inner};
  boundary_.cells().each_part([&](const ClippedPolyhedra& part) { parts.push_back(&part); });
  gather_polyhedra(
      parts, [](const ClippedPolyhedra::Pair&) { return true; }, polyhedra);
}

}  // namespace

std::unique_ptr<SolidBackend> make_vulkan_solid_backend(const Solid& solid, std::shared_ptr<Device> device,
                                                        const VulkanOptions& options, SolidCells how) {
  const Precisions precisions = choose_precisions(*device, options.precision, options.double_rung);
  return std::make_unique<VulkanSolidBackend>(solid, std::move(device), options, precisions, how);
}

}  // namespace bisector::host
