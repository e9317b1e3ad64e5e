#include "host/passes/surface_stage.h"

namespace bisector::host {
namespace {

// By what factor the number of seeds changes before batches and samples are planned anew.
constexpr double kReplan = 1.5;

}  // namespace

SurfaceStage::SurfaceStage(SeedStage& seeds, const Surface& surface, const Capacities& capacities)
    : seeds_(seeds), surface_(surface), sites_(seeds.device(), seeds.is_double()),
      samples_(seeds.device(), seeds.is_double()),
      domain_(seeds.device(), seeds.is_double(), buffers_, sites_, samples_, seeds.exact),
      pairs_(seeds.device(), seeds.is_double(), capacities), store_(seeds.device()), polygon_pass_(seeds.device()),
      batch_pairs_(batch_pairs_of(seeds.device(), capacities.batch_pairs)) {
  buffers_.surface = &surface_;
  const double scale = seeds.seeds.scale;
  buffers_.facets = upload_facets(seeds.device(), seeds.commands, surface_, scale, seeds.is_double());
  if (seeds.has_double_rung())
    buffers_.double_facets = upload_facets(seeds.device(), seeds.commands, surface_, scale, true);
  std::vector<Vec3> points;
  for (const Index v : surface_.used_vertices) points.push_back(surface_.mesh.vertices[v]);
  sites_.set_points(seeds.commands, points, scale);
}

void SurfaceStage::record_owners() {
  // Batches and samples follow the number of seeds.
  const std::size_t count = seeds_.seeds.count();
  const auto n = static_cast<double>(count), last = static_cast<double>(planned_for_);
  if (planned_for_ == 0 || n >= kReplan * last || last >= kReplan * n) {
    planned_for_ = count;
    domain_.plan(seeds_.commands, count, batch_pairs_);
    samples_.set_points(seeds_.commands, domain_.samples().points, seeds_.seeds.scale);
  }
  if (seeds_.sorted_anew()) {
    sites_.forget();
    samples_.forget();
  }
  sites_.record(seeds_.commands, seeds_.seeds, seeds_.neighbours.tree(), seeds_.counters, true);
  samples_.record(seeds_.commands, seeds_.seeds, seeds_.neighbours.tree(), seeds_.counters, false);
}

void SurfaceStage::find_owners() {
  for (;;) {
    seeds_.record();
    record_owners();
    const Counters counters = seeds_.run_counted();
    if (!seeds_.keeps_slots(counters)) continue;
    sites_.complete(seeds_.commands, counters[kUncertainOwners], seeds_.exact);
    return;
  }
}

}  // namespace bisector::host
