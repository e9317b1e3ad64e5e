// How many seeds each feature curve gets, and where (thesis 4.4.3).
#pragma once

#include <vector>

#include "features/placed_seeds.h"
#include "voronoi/surface.h"

namespace bisector {

// Feature curves measured in edges of the result. With density rho the edge length is h = c rho^(-1/4), which gives the
// cells of a surface equal energy; c follows from the number of vertices.
class CurveMeasure {
 public:
  // Both must outlive the object.
  CurveMeasure(const Surface& surface, const FeatureCurves& curves);

  // The c with which equilateral triangles would need `vertices` vertices: N = (2 / sqrt 3) int rho^(1/2) / c^2 over
  // the surface plus half the borders' integral of rho^(1/4) / c.
  double scale(std::size_t vertices) const;
  // The integral of rho^(1/4) along the curve up to a position.
  double at(Index curve, double position) const;
  double whole(Index curve) const { return sums_[curve].back(); }
  // The position where that integral is `measure`.
  double position(Index curve, double measure) const;
  // Edge length at a position for a given c.
  double edge_length(Index curve, double position, double c) const;
  // Edges that the curve should have, at least 1, and 3 if it comes back to where it started.
  std::size_t edges(Index curve, double c) const;

 private:
  const FeatureCurves& curves_;
  std::vector<std::vector<double>> sums_;  // at each point of each curve
  double surface_ = 0, border_ = 0;
};

// Fixed seeds at the corners and seeds along the curves, at equal distances in the measure.
PlacedSeeds seeds_on_features(const FeatureCurves& curves, const CurveMeasure& measure, double c);

// The same for a finer level: where a curve's seeds have moved along it in `coarse`, the finer ones follow.
PlacedSeeds seeds_on_features(const FeatureCurves& curves, const CurveMeasure& measure, double c,
                              const std::vector<SeedPlace>& coarse);

}  // namespace bisector
