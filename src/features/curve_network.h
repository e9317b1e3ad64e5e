// Feature curves as a graph of points, for distances along them and gaps between them.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"
#include "features/curves.h"

namespace bisector {

class CurveNetwork {
 public:
  // The corners of the curves, then points of each curve at equal distances of at most `spacing`.
  CurveNetwork(const FeatureCurves& curves, double spacing);

  const std::vector<Vec3>& points() const { return points_; }
  // The curve that a point lies on; kNone of a corner.
  Index curve(Index point) const { return curve_[point]; }
  double position(Index point) const { return position_[point]; }  // arc length along that curve
  struct Way {
    Index to;
    double length;
    Index corners;  // on the way, without its ends
  };
  // The shortest ways along the curves from a point to all within `reach`, by ascending point.
  std::vector<Way> within(Index from, double reach) const;

 private:
  struct Link {
    Index to;
    double length;
  };
  std::vector<Vec3> points_;
  std::vector<Index> curve_;
  std::vector<double> position_;
  Csr<Link> links_;
};

// How far each point of a network is from other curves, or other parts of its own: the distance to the nearest point
// that is farther along the curves than kDetour times the distance; infinity if that is more than `reach`, one value
// per point. Curves that part at an angle of more than about 47 degrees (2 asin(1 / kDetour)) are no gap, nor is a
// circle. Between curves that part at less, but more than about 17 degrees, there is none as far as the way around
// their corner is shorter than kDetour times the reach: what is acute stays so at any size. What opens more slowly is a
// strip that ends in a corner.
inline constexpr double kDetour = 2.5;
std::vector<double> curve_gaps(const CurveNetwork& network, const std::vector<double>& reach);

}  // namespace bisector
