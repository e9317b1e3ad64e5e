#include "host/passes/vulkan_backend.h"

#include <chrono>
#include <cmath>

#include "backend/cpu_backend.h"
#include "host/passes/cell_pass.h"
#include "host/passes/surface_stage.h"

namespace bisector::host {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

class VulkanBackend : public Backend {
 public:
  VulkanBackend(const Surface& surface, std::unique_ptr<Device> device, const VulkanOptions& options,
                const Precisions& precisions);

  BackendDescription description() const override { return stage_.description(); }
  double mass_tolerance() const override { return double_ ? 1e-12 : 1e-6; }
  // Energies are sums of terms that are off by a few units of 2^-24 each, mostly at random.
  double energy_noise() const override { return double_ ? 0 : 1e-7; }

 private:
  EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override;

  bool double_;
  SeedStage stage_;
  SurfaceStage pairs_;
  CellPass cells_;
  CpuBackend cpu_;
};

VulkanBackend::VulkanBackend(const Surface& surface, std::unique_ptr<Device> device, const VulkanOptions& options,
                             const Precisions& precisions)
    : Backend(surface), double_(precisions.is_double),
      stage_(std::move(device), precisions, options.neighbours, device_scale(surface), surface.box, false),
      pairs_(stage_, surface, options.rooms), cells_(stage_.device(), double_, false), cpu_(surface, options.neighbours) {
  std::vector<Index> triangles;
  for (const FacetSummary& summary : surface.summaries) triangles.push_back(summary.triangle);
  cells_.set_elements(stage_.commands, triangles, surface.facet_of.size());
  stage_.commands.run();
}

EvaluationReport VulkanBackend::compute(const std::vector<Vec3>& given, Want want, Diagram& diagram) {
  CellMoments& moments = diagram.moments;
  if (!stage_.within_reach(given)) {
    EvaluationReport report = cpu_.evaluate(given, want, diagram);
    report.certification.cpu = report.certification.pairs;
    return report;
  }
  stage_.begin(given);
  const Clock::time_point searching = Clock::now();
  for (;;) {
    stage_.record();
    pairs_.record_owners();
    const Counters counters = stage_.run_counted();
    if (!stage_.settle(given, counters)) continue;
    pairs_.settle_owners(counters);
    break;
  }
  const double searched = seconds_since(searching);
  const Clock::time_point clipping = Clock::now();

  Certification certification;
  pairs_.find_pairs(certification);
  cells_.sort(stage_.commands, stage_.seeds.count(), stage_.scan, pairs_.store());
  const auto sum = [&] { cells_.sum(stage_, pairs_.store(), moments); };
  sum();
  if (!double_) {
    // If all masses still do not add up, what is left to doubt climbs too, and in the end everything.
    for (const float share : {1.0f, 0.05f, 0.0f}) {
      if (pairs_.refine(cells_.cells(), share, certification) > 0) sum();
      if (std::abs(moments.mass - mass()) <= mass_tolerance() * mass()) break;
    }
  }
  stage_.set_step_masses(moments);
  certification.pairs = moments.triangles.values.size();
  DiagramSeconds seconds;
  (stage_.delaunay() ? seconds.delaunay : seconds.neighbours) = stage_.lists_seconds();
  seconds.neighbours += searched;
  seconds.clip = seconds_since(clipping);
  if (includes(want, Want::polygons)) pairs_.polygons(diagram.polygons);
  seconds.device = stage_.take_seconds();
  return {certification, seconds};
}

}  // namespace

std::unique_ptr<Backend> make_vulkan_backend(const Surface& surface, std::unique_ptr<Device> device,
                                             const VulkanOptions& options) {
  const Precisions precisions = choose_precisions(*device, options.precision, options.double_rung);
  return std::make_unique<VulkanBackend>(surface, std::move(device), options, precisions);
}

}  // namespace bisector::host
