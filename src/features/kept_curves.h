// Which curves run beside others.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "features/candidates.h"

namespace bisector {

// The candidates that stay, as points at small distances, and how far it is along them.
class KeptCurves {
 public:
  // Curves nearer to each other than `width` are beside each other.
  KeptCurves(const std::vector<Vec3>& vertices, double width) : vertices_(&vertices), width_(width) {}

  void keep(const Candidate& candidate);

  // Whether each of the samples of a candidate runs within the width of what stays, though it is far along the curves.
  std::vector<char> beside(const Candidate& candidate, const std::vector<Sample>& samples) const;

  bool is_near(const Vec3& p) const;

  // Half the width apart, so that no other curve slips through.
  std::vector<Sample> samples(const Candidate& candidate) const {
    return samples_of(candidate, *vertices_, kStep * width_);
  }

  // Between samples, in widths.
  static constexpr double kStep = 0.5;

 private:
  using Ways = std::unordered_map<Index, double>;  // lengths of ways to corners
  using Box = std::array<std::int64_t, 3>;         // of a grid as wide as the width

  struct Curve {
    Index first, last;
    double length;
    bool closed;
  };
  struct Point {
    Sample sample;
    Index curve;
  };

  Box box_of(const Vec3& p) const;
  template <class Body>
  void each_near(const Vec3& p, const Body& body) const;
  Ways ways(Index corner) const;
  double way_to(const Point& point, const Ways& ways) const;

  const std::vector<Vec3>* vertices_;
  double width_;
  std::vector<Curve> curves_;
  std::map<Box, std::vector<Point>> points_;
  std::map<Index, std::vector<Index>> at_;  // curves that end at a corner
};

}  // namespace bisector
