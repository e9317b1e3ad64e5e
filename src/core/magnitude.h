// What coordinates the pipelines take.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "bisector/error.h"
#include "core/geometry.h"

namespace bisector {

// Products of six lengths, as in bounds of determinants and in energies of weighted volumes, stay finite.
inline constexpr double kLargestCoordinate = 1e40;

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

}  // namespace bisector
