// What coordinates the pipelines take.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "bisector/error.h"
#include "core/geometry.h"

namespace bisector {

// Products of six lengths, as in bounds of determinants and in energies of weighted volumes, stay finite.
inline constexpr double kLargestCoordinate = 1e40;
// Such products of a whole model do not underflow.
inline constexpr double kSmallestModel = 1e-40;

inline double largest_coordinate(const std::vector<Vec3>& points) {
  double largest = 0;
  for (const Vec3& p : points)
    for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(p[k]));
  return largest;
}

// Throws Error. `kind`: what the points are, such as "vertex".
inline void require_moderate(const std::vector<Vec3>& points, const char* kind) {
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const double x = points[i][k];
      if (!std::isfinite(x)) throw Error(fmt::format("{} {}: a coordinate is not finite; mend it", kind, i));
      if (std::abs(x) > kLargestCoordinate)
        throw Error(fmt::format("{} {}: a coordinate is beyond {:g}; scale the model", kind, i, kLargestCoordinate));
    }
}

// The same for the vertices of a model, which may not all be close to the origin: products would vanish. Points that
// all are the origin pass, for what has no area or volume is told elsewhere.
inline void require_moderate_model(const std::vector<Vec3>& points, const char* kind) {
  require_moderate(points, kind);
  const double largest = largest_coordinate(points);
  if (0 < largest && largest < kSmallestModel)
    throw Error(fmt::format("no {} has a coordinate of {:g} or more; scale the model", kind, kSmallestModel));
}

}  // namespace bisector
