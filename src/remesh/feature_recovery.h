// Making the dual contain every feature curve as a chain of edges (thesis 4.4.3).
//
// A curve is in the dual if it runs through the cells of its own seeds alone, once through each, and every two that
// follow each other on it have an edge in the dual with a triangle on each sheet. A foreign cell on a curve is moved
// away if it hardly touches it, put elsewhere if the curve has its seeds, snapped to the curve if it lacks some, and
// met with one more seed on the curve if it belongs to another curve: across from the foreign one, or, where the two
// curves meet at a corner, as far from it: seeds at equal distances do not own parts of each other's curve, however
// small the angle. Such pairs are fixed.
#pragma once

#include <array>
#include <vector>

#include "cvt/optimise.h"
#include "remesh/feature_seeds.h"
#include "remesh/feature_trace.h"

namespace bisector {

// A stretch of a curve that is not in the dual.
struct FeatureFault {
  Index curve;
  double from, to;  // positions; beyond the end of a closed curve if it leads over its start
  Index cell;       // that does not belong there; kNone if a seed is missing
};

struct FeatureReport {
  std::vector<std::array<Index, 2>> edges;  // pairs of seeds along the curves, lower first, sorted
  std::vector<FeatureFault> faults;         // by curve
  std::vector<Index> broken;                // curves with faults, ascending
};

// `diagram` is that of seeds with these places, with polygons and dual.
FeatureReport check_features(const FeatureTrace& trace, const FeatureCurves& curves,
                             const std::vector<SeedPlace>& places, const Diagram& diagram);

// Puts seeds on the surface whose cells reach a curve elsewhere, where the energy is high, and optimises again: curves
// have as many seeds of their own as they need. `stand_in` as in optimise_around().
void clear_features(CvtRun& run, const FeatureTrace& trace, const CurveMeasure& measure, OptimiseOptions options,
                    Backend* stand_in = nullptr);

// Mends the curves that are broken and optimises again, for a bounded number of rounds. The count is kept in the first
// rounds; in the last ones seeds are inserted and nothing moves. `c` is the scale of CurveMeasure.
FeatureReport recover_features(CvtRun& run, const FeatureTrace& trace, const CurveMeasure& measure, double c,
                               OptimiseOptions options, Backend* stand_in = nullptr);

}  // namespace bisector
