// Polygons into triangles.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector {

// Splits polygons in the plane of their Newell normal, seen along its main axis, and appends to `triangles`. Both
// vectors must outlive the object; memory is kept between calls.
class PolygonSplitter {
 public:
  PolygonSplitter(const std::vector<Vec3>& vertices, std::vector<Triangle>& triangles)
      : vertices_(vertices), triangles_(triangles) {}

  // False if the polygon is degenerate or crosses itself, so that a part of it was split like a fan.
  bool split(const Index* corners, std::size_t n);

 private:
  struct Point {
    double x, y;
  };

  const Vec3& position(std::size_t i) const { return vertices_[corners_[i]]; }
  void emit(std::size_t i, std::size_t j, std::size_t k) {
    triangles_.push_back({corners_[i], corners_[j], corners_[k]});
  }
  // Positive if corners i, j, k turn to the left.
  double turn(std::size_t i, std::size_t j, std::size_t k) const {
    const Point &a = plane_[i], &b = plane_[j], &c = plane_[k];
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  }
  // Fills plane_; false if the polygon has no normal.
  bool project(std::size_t n);
  // Splits along the shorter diagonal; false, and nothing is done, if the quad is not strictly convex.
  bool split_convex_quad();
  // False if it ran out of ears or of tests; the rest became a fan.
  bool clip_ears(std::size_t n);
  // A corner that turns left and whose triangle holds none of the other corners that do not.
  bool is_ear(std::size_t i);

  static constexpr std::size_t kMostTests = 500'000'000;  // seconds, for one polygon of a hundred thousand corners

  const std::vector<Vec3>& vertices_;
  std::vector<Triangle>& triangles_;
  const Index* corners_ = nullptr;
  std::vector<Point> plane_;
  std::vector<std::size_t> previous_, next_, blocking_;
  std::vector<char> blocks_;
  std::size_t tests_ = 0;
};

}  // namespace bisector
