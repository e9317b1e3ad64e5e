#include "core/degenerate.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry.h"

namespace bisector {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

// Shewchuk's bound for a 2x2 determinant of differences, (3 + 16u)u, rounded up; the floor covers underflow.
bool certainly_not_zero(double left, double right) {
  constexpr double kBound = 4 * 0x1p-53, kFloor = 1e-290;
  return std::abs(left - right) > kBound * (std::abs(left) + std::abs(right)) + kFloor;
}

}  // namespace

bool collinear(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a;
  if (certainly_not_zero(u.x * v.y, u.y * v.x) || certainly_not_zero(u.y * v.z, u.z * v.y) ||
      certainly_not_zero(u.z * v.x, u.x * v.z))
    return false;
  const auto point = [](const Vec3& p) { return Kernel::Point_3(p.x, p.y, p.z); };
  return CGAL::collinear(point(a), point(b), point(c));
}

double triangle_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a;
  const double reach =
      std::max({std::abs(u.x), std::abs(u.y), std::abs(u.z), std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (reach == 0 || collinear(a, b, c)) return 0;
  constexpr double kLeast = std::numeric_limits<double>::denorm_min();
  if (reach > 1e-60 && reach < 1e60) return std::max(0.5 * norm(cross(u, v)), kLeast);
  // The fourth power of a length leaves the range of doubles long before its square does; powers of two are exact.
  int exponent = 0;
  std::frexp(reach, &exponent);
  exponent = std::max(exponent, -1000);
  const double scale = std::ldexp(1.0, -exponent);
  return std::max(std::ldexp(0.5 * norm(cross(scale * u, scale * v)), 2 * exponent), kLeast);
}

}  // namespace bisector
