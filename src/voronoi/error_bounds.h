// Error bounds that the clippers of triangles and of tetrahedra share.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/geometry.h"

namespace bisector {

inline constexpr double kUnit = 0x1p-53;  // unit roundoff of double
// Lines or planes that meet at a smaller angle (sine, squared) have their vertex computed exactly, and below the second
// in two steps.
inline constexpr double kSteep = 1e-12, kShallow = 1e-8;
// No product of coordinates this small is told from 0, for the bounds do not cover underflow.
inline constexpr double kTiny = 1e-300;
// The errors of the coordinates of a corner of the input relative to the seed, and of a vertex from exact arithmetic,
// in units of the corners' largest coordinate.
inline constexpr double kCornerSlack = 8 * kUnit, kExactSlack = 16 * kUnit;

inline double max_coordinate(const Vec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }
inline double taxicab(const Vec3& p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z); }

// Against what the product of a point and the vector d to another seed is compared, given |d|^2 / 2: below the first
// limit the point lies before the bisector, above the second behind it, and between them it is uncertain.
struct BisectorLimits {
  double before, behind;

  explicit BisectorLimits(double half_square)
      : before(half_square * (1 - 1e-12) - kTiny), behind(half_square * (1 + 1e-12) + kTiny) {}
};

}  // namespace bisector
