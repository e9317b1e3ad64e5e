// Vectors with a fixed order of operations, so that sums and products round alike on every backend, and boxes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

inline Vec3& operator+=(Vec3& a, const Vec3& b) {
  a.x += b.x;
  a.y += b.y;
  a.z += b.z;
  return a;
}
inline Vec3& operator-=(Vec3& a, const Vec3& b) {
  a.x -= b.x;
  a.y -= b.y;
  a.z -= b.z;
  return a;
}
inline Vec3& operator*=(Vec3& a, double s) {
  a.x *= s;
  a.y *= s;
  a.z *= s;
  return a;
}
inline Vec3 operator+(Vec3 a, const Vec3& b) { return a += b; }
inline Vec3 operator-(Vec3 a, const Vec3& b) { return a -= b; }
inline Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
inline Vec3 operator*(double s, Vec3 a) { return a *= s; }

inline double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm2(const Vec3& a) { return dot(a, a); }
inline double norm(const Vec3& a) { return std::sqrt(norm2(a)); }

inline constexpr double kRadiansPerDegree = std::numbers::pi / 180, kDegreesPerRadian = 180 / std::numbers::pi;

// The direction of a vector, of length 1; zero for the zero vector.
inline Vec3 unit(const Vec3& a) {
  const double length = norm(a);
  return length > 0 ? (1 / length) * a : Vec3{};
}

// A vector of length 1 perpendicular to `n`, which has length 1, and to the x axis, or to the y axis if `n` is near the
// x axis.
Vec3 perpendicular(const Vec3& n);

// Normal of the triangle (a, b, c), as long as twice its area, on the side from which the corners run
// counter-clockwise.
inline Vec3 twice_area_normal(const Vec3& a, const Vec3& b, const Vec3& c) { return cross(b - a, c - a); }

// Twice the vector area of any surface that a closed polygon bounds: `point_of` gives the place of each of its corners.
template <class Loop, class PointOf = std::identity>
Vec3 twice_vector_area(const Loop& loop, const PointOf& point_of = {}) {
  Vec3 sum;
  for (std::size_t i = 2; i < loop.size(); ++i)
    sum += twice_area_normal(point_of(loop[0]), point_of(loop[i - 1]), point_of(loop[i]));
  return sum;
}

// Six times the signed volume of the tetrahedron (a, b, c, d), rounded: positive as orientation() says.
inline double rounded_six_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return dot(b - a, cross(c - a, d - a));
}

struct Box {
  Vec3 lo, hi;
  double diagonal() const { return norm(hi - lo); }
};

// Bounding box of points; the zero box if there are none.
inline Box bounding_box(const std::vector<Vec3>& points) {
  if (points.empty()) return {};
  Box box{points[0], points[0]};
  for (const Vec3& p : points)
    for (int k = 0; k < 3; ++k) {
      if (p[k] < box.lo[k]) box.lo[k] = p[k];
      if (p[k] > box.hi[k]) box.hi[k] = p[k];
    }
  return box;
}

// Bounding box of the points that triangles use; the zero box if there are none.
inline Box bounding_box(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
  if (triangles.empty()) return {};
  Box box{points[triangles[0][0]], points[triangles[0][0]]};
  for (const Triangle& t : triangles)
    for (const Index v : t)
      for (int k = 0; k < 3; ++k) {
        box.lo[k] = std::min(box.lo[k], points[v][k]);
        box.hi[k] = std::max(box.hi[k], points[v][k]);
      }
  return box;
}
inline Box bounding_box(const TriangleMesh& mesh) { return bounding_box(mesh.vertices, mesh.triangles); }

// Where on the segment from a (0) to b (1) the point nearest to p lies; 0 if a and b are the same point.
double nearest_parameter(const Vec3& p, const Vec3& a, const Vec3& b);

// Nearest point to p of the segment from a to b.
Vec3 nearest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b);

// Nearest point to p of the triangle (a, b, c).
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace bisector
