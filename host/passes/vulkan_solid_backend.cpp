#include "host/passes/vulkan_solid_backend.h"

#include <chrono>
#include <cmath>

#include "backend/cpu_backend.h"
#include "host/passes/cell_pass.h"
#include "host/passes/polyhedra_pass.h"
#include "host/passes/surface_stage.h"

namespace bisector::host {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

Box box_of(const Solid& solid) {
  std::vector<Vec3> points(solid.enclosure.begin(), solid.enclosure.end());
  points.insert(points.end(), {solid.box.lo, solid.box.hi});
  return bounding_box(points);
}

class VulkanSolidBackend : public SolidBackend {
 public:
  VulkanSolidBackend(const Solid& solid, std::unique_ptr<Device> device, const VulkanOptions& options,
                     const Precisions& precisions, InnerCells inner);

  BackendDescription description() const override { return stage_.description(); }
  double mass_tolerance() const override { return double_ ? 1e-12 : 1e-6; }
  // Energies are sums of terms that are off by a few units of 2^-24 each, mostly at random.
  double energy_noise() const override { return double_ ? 0 : 1e-7; }

 private:
  EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override;
  void find_owners(const std::vector<Vec3>& seeds);
  PairJob job() {
    return {stage_.commands, stage_.seeds, stage_.neighbours, stage_.scan, stage_.counters, store_, tets_};
  }

  bool double_;
  SeedStage stage_;
  SurfaceStage shell_;
  CellPass shell_cells_;
  DeviceSolid device_solid_;
  OwnerPass corners_;
  TetPairs tets_;
  PairPass pairs_;
  PairStore store_;
  CellPass cells_;
  PolyhedraPass polyhedra_;
  CpuSolidBackend cpu_;
};

VulkanSolidBackend::VulkanSolidBackend(const Solid& solid, std::unique_ptr<Device> device, const VulkanOptions& options,
                                       const Precisions& precisions, InnerCells inner)
    : SolidBackend(solid), double_(precisions.is_double),
      stage_(std::move(device), precisions, options.neighbours, device_scale(solid), box_of(solid), true),
      shell_(stage_, solid.boundary, options.rooms), shell_cells_(stage_.device(), double_, false),
      device_solid_(stage_.device(), stage_.commands, solid, stage_.seeds.scale, double_, precisions.double_rung),
      corners_(stage_.device(), double_),
      tets_(double_, device_solid_, corners_, stage_.exact, inner == InnerCells::whole && solid.density.empty(),
            options.rooms.batch_pairs),
      pairs_(stage_.device(), double_, options.rooms), store_(stage_.device()), cells_(stage_.device(), double_, true),
      polyhedra_(stage_.device()), cpu_(solid, options.neighbours, inner) {
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

void VulkanSolidBackend::find_owners(const std::vector<Vec3>& given) {
  for (;;) {
    stage_.record();
    shell_.record_owners();
    const Counters counters = stage_.run_counted();
    if (!stage_.settle(given, counters)) continue;
    shell_.settle_owners(counters);
    break;
  }
  if (stage_.sorted_anew()) corners_.forget();
  stage_.commands.fill(stage_.counters, kLostSites * sizeof(std::uint32_t), sizeof(std::uint32_t), 0);
  corners_.record(stage_.commands, stage_.seeds, stage_.neighbours.grid(), stage_.counters, true);
  const Counters counters = stage_.run_counted();
  if (!counters[kLostSites]) return;
  const std::vector<Index> lost = corners_.lost(stage_.commands, counters[kLostSites]);
  std::vector<Vec3> points;
  for (const Index corner : lost) points.push_back(solid().mesh.vertices[device_solid_.vertices[corner]]);
  corners_.settle(stage_.commands, lost, stage_.exact.owners(points));
}

EvaluationReport VulkanSolidBackend::compute(const std::vector<Vec3>& given, Want want, Diagram& diagram) {
  CellMoments& moments = diagram.moments;
  if (!stage_.within_reach(given)) {
    EvaluationReport report = cpu_.evaluate(given, want, diagram);
    report.certification.cpu = report.certification.pairs;
    return report;
  }
  stage_.begin(given);
  const Clock::time_point searching = Clock::now();
  find_owners(given);
  const double searched = seconds_since(searching);

  const Clock::time_point pairing = Clock::now();
  Certification certification;
  CellMoments shell;
  shell_.find_pairs(certification);
  shell_cells_.sort(stage_.commands, stage_.seeds.count(), stage_.scan, shell_.store());
  shell_cells_.sum(stage_, shell_.store(), shell);
  if (includes(want, Want::polygons)) shell_.polygons(diagram.polygons);
  tets_.set_shell(shell_.store(), shell, stage_.seeds.count());
  const double paired = seconds_since(pairing);

  const Clock::time_point clipping = Clock::now();
  pairs_.run(job(), certification);
  cells_.sort(stage_.commands, stage_.seeds.count(), stage_.scan, store_);
  const auto sum = [&] { cells_.sum(stage_, store_, moments); };
  sum();
  if (!double_) {
    // If all masses still do not add up, what is left to doubt climbs too, and in the end everything.
    for (const float share : {1.0f, 0.05f, 0.0f}) {
      if (pairs_.refine(job(), cells_.cells(), share, certification) > 0) sum();
      if (std::abs(moments.mass - mass()) <= mass_tolerance() * mass()) break;
    }
  }
  certification.pairs = moments.triangles.values.size();
  moments.triangles = std::move(shell.triangles);
  stage_.set_step_masses(moments);
  DiagramSeconds seconds;
  (stage_.delaunay() ? seconds.delaunay : seconds.neighbours) = stage_.lists_seconds();
  seconds.neighbours += searched;
  seconds.pairs = paired;
  seconds.clip = seconds_since(clipping);
  if (includes(want, Want::polyhedra)) polyhedra_.run(pairs_, job(), tets_, stage_.exact, diagram.polyhedra);
  seconds.device = stage_.take_seconds();
  return {certification, seconds};
}

}  // namespace

std::unique_ptr<SolidBackend> make_vulkan_solid_backend(const Solid& solid, std::unique_ptr<Device> device,
                                                        const VulkanOptions& options, InnerCells inner) {
  const Precisions precisions = choose_precisions(*device, options.precision, options.double_rung);
  return std::make_unique<VulkanSolidBackend>(solid, std::move(device), options, precisions, inner);
}

}  // namespace bisector::host
