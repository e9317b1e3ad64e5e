// Seeds of a surface and its curves, as the pipeline leaves them before the last passes.
#pragma once

#include <cstddef>
#include <limits>

#include "backend/project.h"
#include "cvt/multilevel.h"
#include "cvt/optimise.h"
#include "remesh/feature_recovery.h"
#include "remesh/feature_seeds.h"

namespace bisector::test {

// Puts so many seeds on the surface and curves of the run, and optimises them held there. `trace` is of these curves.
inline void place_and_optimise(CvtRun& run, const FeatureTrace& trace, std::size_t count, int iterations) {
  OptimiseOptions step;
  step.iterations = iterations;
  step.constrained = true;
  const FeatureCurves& curves = run.curves();
  const CurveMeasure measure(run.surface(), curves);
  if (curves.size() > 0) run.seeds = seeds_on_features(curves, measure, measure.scale(count));
  run.seeds.add(initial_seeds(run.surface(), count - run.seeds.size(), 1));
  if (iterations > 0) optimise(run, step);
  if (curves.size() > 0) recover_features(run, trace, measure, measure.scale(count), step);
}

// The point of a surface that is nearest to p, by looking at all of it.
inline Vec3 nearest_of_all(const Surface& surface, const Vec3& p) {
  double least = std::numeric_limits<double>::infinity();
  Vec3 nearest;
  for (const Facet& f : surface.facets) {
    const Vec3 on = nearest_on_triangle(p, f.corners[0], f.corners[1], f.corners[2]);
    if (!(norm2(on - p) < least)) continue;
    least = norm2(on - p);
    nearest = on;
  }
  return nearest;
}

}  // namespace bisector::test
