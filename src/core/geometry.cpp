#include "core/geometry.h"

#include <algorithm>

namespace bisector {

Vec3 perpendicular(const Vec3& n) { return unit(cross(n, std::abs(n.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0})); }

double nearest_parameter(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 d = b - a;
  const double length2 = norm2(d);
  return length2 > 0 ? std::clamp(dot(p - a, d) / length2, 0.0, 1.0) : 0.0;
}

Vec3 nearest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  return a + nearest_parameter(p, a, b) * (b - a);
}

// Voronoi regions of the triangle's corners and edges (Ericson, Real-Time Collision Detection, 5.1.5). Quotients are
// products with reciprocals, as devices compute them (kernels/move_seeds.comp).
Vec3 nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3 bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + (d1 * (1 / (d1 - d3))) * ab;
  const Vec3 cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + (d2 * (1 / (d2 - d6))) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + ((d4 - d3) * (1 / ((d4 - d3) + (d5 - d6)))) * (c - b);
  const double scale = 1 / (va + vb + vc);
  return a + (vb * scale) * ab + (vc * scale) * ac;
}

}  // namespace bisector
