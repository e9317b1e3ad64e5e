// Runs without features, for tests of what takes a run.
#pragma once

#include <utility>
#include <vector>

#include "cvt/optimise.h"
#include "cvt/run.h"

namespace bisector::test {

// A run together with what it refers to.
struct FreeRun {
  FreeRun(Backend& backend, std::vector<Vec3> seeds, Context given = {})
      : context(std::move(given)), run(backend, curves, context) {
    run.seeds = PlacedSeeds(std::move(seeds));
  }
  FreeRun(const FreeRun&) = delete;

  const std::vector<Vec3>& seeds() const { return run.seeds.positions(); }
  const CellMoments& moments() { return run.diagram().moments; }

  FeatureCurves curves;
  Context context;
  CvtRun run;
};

// Free steps, then such along the surface.
inline void optimise_both(CvtRun& run, int free, int constrained) {
  OptimiseOptions options;
  options.iterations = free;
  optimise(run, options);
  options.constrained = true;
  options.iterations = constrained;
  optimise(run, options);
}

inline std::vector<Vec3> optimised_seeds(Backend& backend, std::vector<Vec3> seeds, const OptimiseOptions& options) {
  FreeRun free(backend, std::move(seeds));
  optimise(free.run, options);
  return free.seeds();
}

}  // namespace bisector::test
