// Feature curves as a graph of points, for distances along them and gaps between them.
#pragma once

#include <array>
#include <compare>
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
  // From one point to another along the curve that both lie on; infinity if there is none.
  double along(Index a, Index b) const;

  struct Way {
    double length;
    Index corners;  // on the way, without its ends

    friend auto operator<=>(const Way&, const Way&) = default;
  };

  // The shortest ways along the curves from one point to others. Memory is kept from search to search.
  class Search {
   public:
    explicit Search(const CurveNetwork& network);
    // Searches from a point, for ways no longer than `reach`.
    void start(Index from, double reach);
    // Of the shortest ways to a point that with the fewest corners. An infinite length if it is longer than the reach.
    Way to(Index point) const;

   private:
    const CurveNetwork& network_;
    Index from_ = kNone;
    double reach_ = 0;
    std::vector<Way> to_corner_;
    std::vector<Index> reached_;
  };

 private:
  struct Link {
    Index to;  // corner
    double length;
  };
  struct Line {
    std::array<Index, 2> ends;
    double length;
  };
  // Calls visit(corner, length) for the nearest corners along a point's curve, for a corner with itself.
  template <class Visit>
  void nearest_corners(Index point, const Visit& visit) const {
    if (curve_[point] == kNone) return visit(point, 0.0);
    const Line& line = lines_[curve_[point]];
    if (line.ends[0] == kNone) return;
    visit(line.ends[0], position_[point]);
    visit(line.ends[1], line.length - position_[point]);
  }

  std::vector<Vec3> points_;
  std::vector<Index> curve_;
  std::vector<double> position_;
  std::vector<Line> lines_;  // the curves
  Csr<Link> links_;          // of corners
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
