#include "core/orientation.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mpzf.h>

#include <cmath>

#include "core/geometry.h"

namespace bisector {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

}  // namespace

int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const auto point = [](const Vec3& p) { return Kernel::Point_3(p.x, p.y, p.z); };
  return static_cast<int>(CGAL::orientation(point(a), point(b), point(c), point(d)));
}

int orientation_yz(const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto point = [](const Vec3& p) { return Kernel::Point_2(p.y, p.z); };
  return static_cast<int>(CGAL::orientation(point(a), point(b), point(c)));
}

int enclosed_volume_sign(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
  if (triangles.empty()) return 0;
  const Vec3 origin = vertices[triangles[0][0]];
  double sum = 0, size = 0;
  for (const Triangle& t : triangles) {
    const Vec3 a = vertices[t[0]] - origin, b = vertices[t[1]] - origin, c = vertices[t[2]] - origin;
    sum += dot(a, cross(b, c));
    size += norm(a) * norm(b) * norm(c);
  }
  // Far above the rounding of sums of 2^32 terms.
  if (std::isfinite(size) && size > 1e-280 && std::abs(sum) > 1e-5 * size) return sum > 0 ? 1 : -1;
  using Exact = CGAL::Mpzf;
  Exact exact = 0;
  for (const Triangle& t : triangles) {
    Exact p[3][3];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) p[i][k] = Exact(vertices[t[i]][k]) - Exact(origin[k]);
    exact = exact + p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
            p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) + p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
  }
  return static_cast<int>(CGAL::sign(exact));
}

}  // namespace bisector
