#include "tetmesh/tet_run.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bisector {
namespace {

constexpr double kOptimising = 0.8;  // of the time of the whole run, about, is spent on moving sites

}  // namespace

void optimise_sites(TetRun& run, Backend& backend, CvtState& state, const std::string& phase, double share, bool constrained) {
  OptimiseOptions step;
  step.tolerance = run.options.tolerance;
  step.curves = &run.curves;
  step.phase = phase;
  step.constrained = constrained;
  step.iterations = static_cast<int>(std::ceil(run.options.iterations * share));
  step.done = run.done;
  step.share = kOptimising * share * std::min(1.0, static_cast<double>(state.seeds.size()) / static_cast<double>(run.wanted));
  optimise(backend, state, step, run.totals, run.context);
  run.done += step.share;
}

CvtState inner_sites(std::vector<Vec3> seeds) {
  CvtState state;
  state.seeds = std::move(seeds);
  state.places.assign(state.seeds.size(), {SeedPlace::Kind::interior});
  return state;
}

std::vector<Vec3> inner_seeds(const CvtState& state) {
  std::vector<Vec3> inner;
  for (std::size_t i = 0; i < state.seeds.size(); ++i)
    if (state.places[i].kind == SeedPlace::Kind::interior) inner.push_back(state.seeds[i]);
  return inner;
}

CvtState with_boundary(const RemeshResult& surface, const std::vector<Vec3>& inner) {
  CvtState state;
  state.seeds = surface.mesh.vertices;
  state.places = surface.places;
  state.seeds.insert(state.seeds.end(), inner.begin(), inner.end());
  state.places.resize(state.seeds.size(), {SeedPlace::Kind::interior});
  return state;
}

std::vector<Index> inner_sites_at_boundary(const CvtState& state) {
  std::vector<Index> found;
  for (Index i = 0; i < state.seeds.size(); ++i)
    if (state.places[i].kind == SeedPlace::Kind::interior && state.moments.triangles.size(i) > 0) found.push_back(i);
  return found;
}

}  // namespace bisector
