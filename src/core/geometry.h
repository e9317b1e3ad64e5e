// Vectors with a fixed order of operations, so that sums and products round alike on every backend, and boxes.
#pragma once

#include <cmath>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

inline Vec3& operator+=(Vec3& a, const Vec3& b) { a.x += b.x; a.y += b.y; a.z += b.z; return a; }
inline Vec3& operator-=(Vec3& a, const Vec3& b) { a.x -= b.x; a.y -= b.y; a.z -= b.z; return a; }
inline Vec3& operator*=(Vec3& a, double s) { a.x *= s; a.y *= s; a.z *= s; return a; }
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

// Nearest point to p of the triangle (a, b, c).
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace bisector
