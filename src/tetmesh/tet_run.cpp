#include "tetmesh/tet_run.h"

#include <algorithm>
#include <cmath>

namespace bisector {
namespace {

constexpr double kOptimising = 0.8;  // of the time of the whole run, about, is spent on moving sites

}  // namespace

void optimise_sites(TetRun& run, const std::string& phase, double share, bool constrained) {
  const double part = static_cast<double>(run.sites.seeds.size()) / static_cast<double>(run.wanted);
  OptimiseOptions step;
  step.tolerance = run.options.tolerance;
  step.phase = phase;
  step.constrained = constrained;
  step.iterations = static_cast<int>(std::ceil(run.options.iterations * share));
  step.done = run.done;
  step.share = kOptimising * share * std::min(1.0, part);
  optimise(run.sites, step);
  run.done += step.share;
}

PlacedSeeds with_boundary(const RemeshResult& surface, const std::vector<Vec3>& inside) {
  PlacedSeeds seeds(surface.mesh.vertices, surface.places);
  seeds.add(inside, {SeedPlace::Kind::interior});
  return seeds;
}

std::vector<Index> inner_sites_at_boundary(const PlacedSeeds& seeds, const Csr<Index>& triangles) {
  std::vector<Index> found;
  for (Index i = 0; i < seeds.size(); ++i)
    if (seeds.kind(i) == SeedPlace::Kind::interior && triangles.size(i) > 0) found.push_back(i);
  return found;
}

}  // namespace bisector
