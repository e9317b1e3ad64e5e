#include "bisector/remesh/remesh.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "bisector/core/parallel.h"
#include "bisector/cvt/multilevel.h"
#include "bisector/cvt/optimise.h"
#include "bisector/remesh/topology_control.h"
#include "bisector/voronoi/dual.h"
#include "bisector/voronoi/tiling.h"

namespace bisector {
namespace {

using Clock = std::chrono::steady_clock;

// Of the steps allowed per level: the coarsest of several levels settles soon, the finest starts near its minimum, and seeds that
// are put on the surface move little.
constexpr double kCoarsestShare = 0.6, kFinestShare = 0.5, kConstrainedShare = 0.05;

double steps_share(std::size_t level, std::size_t levels) {
  if (levels == 1) return 1;
  return level + 1 == levels ? kFinestShare : level == 0 ? kCoarsestShare : 1;
}

int share_of(int iterations, double share) { return static_cast<int>(std::ceil(iterations * share)); }

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

void check_options(const RemeshOptions& options) {
  if (options.seeds.empty() && options.vertices < 4)
    throw Error("a remeshed surface needs at least 4 vertices; ask for more");
  if (!options.seeds.empty() && options.seeds.size() < 4)
    throw Error("a remeshed surface needs at least 4 seeds; give more");
}

}  // namespace

RemeshResult remesh(const TriangleMesh& input, const RemeshOptions& options, const Context& context) {
  const auto begin = Clock::now();
  check_options(options);
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  const Surface surface(input);
  const std::unique_ptr<Backend> backend = make_backend(surface, options.compute, context);
  RemeshResult result = remesh(*backend, options, context);
  result.seconds.total = seconds_since(begin);
  return result;
}

RemeshResult remesh(Backend& backend, const RemeshOptions& options, const Context& context) {
  const auto begin = Clock::now();
  check_options(options);
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  const Surface& surface = backend.surface();
  RemeshResult result;
  result.input_topology = analyse_topology(surface.mesh.triangles, surface.mesh.vertices.size());
  CvtState state;
  OptimiseTotals totals;
  RestrictedPolygons polygons;

  const std::vector<std::size_t> counts =
      options.seeds.empty() ? level_counts(options.vertices, result.input_topology.euler,
                                           result.input_topology.components, options.levels)
                            : std::vector<std::size_t>{options.seeds.size()};
  state.seeds = options.seeds.empty() ? initial_seeds(surface, counts.front(), options.random_seed) : options.seeds;

  // Shares of the work: an evaluation costs about as much as its facets and three times its seeds.
  const auto cost = [&](std::size_t seeds) { return static_cast<double>(surface.facets.size() + 3 * seeds); };
  const bool constrain = options.energy == Energy::constrained;
  double total = constrain ? kConstrainedShare * cost(counts.back()) : 0;
  for (std::size_t level = 0; level < counts.size(); ++level) total += steps_share(level, counts.size()) * cost(counts[level]);

  OptimiseOptions step;
  step.share = 0;
  step.tolerance = options.tolerance;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    step.phase = counts.size() > 1 ? fmt::format("level {}/{}", level + 1, counts.size()) : "optimising";
    const double share = steps_share(level, counts.size());
    step.iterations = share_of(options.iterations, share);
    step.done += std::exchange(step.share, share * cost(counts[level]) / total);
    optimise(backend, state, step, totals, context);
    if (level + 1 == counts.size()) break;
    backend.evaluate(state.seeds, state.moments, polygons);
    state.seeds = refine(polygons, state.moments, state.seeds, counts[level + 1]);
    for (std::size_t size = 0; state.seeds.size() != counts[level + 1] && state.seeds.size() != size;) {
      size = state.seeds.size();
      backend.evaluate(state.seeds, state.moments, polygons);
      set_count(polygons, state.moments, counts[level + 1], state.seeds);
    }
  }
  if (constrain) {
    step.constrained = true;
    step.phase = "on the surface";
    step.iterations = share_of(options.iterations, kConstrainedShare);
    step.done += std::exchange(step.share, kConstrainedShare * cost(counts.back()) / total);
    optimise(backend, state, step, totals, context);
  }
  if (options.topology == TopologyControl::enforce)
    enforce_topology(backend, state, polygons, result.input_topology, step, totals, context);
  else
    backend.evaluate(state.seeds, state.moments, polygons);

  const auto extraction = Clock::now();
  result.untiled = count_untiled(surface, polygons);
  result.mesh = dual_mesh(state.seeds, polygons);
  result.topology = analyse_topology(result.mesh.triangles, result.mesh.vertices.size());
  result.topology_matches = same_topology(result.topology, result.input_topology);
  if (result.topology_matches && result.mesh.vertices.size() > counts.back())
    context.warn(fmt::format("{} vertices instead of {}: fewer did not give the input's topology",
                             result.mesh.vertices.size(), counts.back()));
  result.iterations = totals.iterations;
  result.evaluations = totals.evaluations;
  result.energy = state.energy;
  result.gradient_norm = state.gradient_norm;
  result.certification = state.moments.certification;
  result.device = backend.description();
  result.seconds = {seconds_since(begin), totals.seconds_lbfgs, seconds_since(extraction), totals.seconds};
  return result;
}

}  // namespace bisector
