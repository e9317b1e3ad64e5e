// Distances along and from polylines, and what else the fits of branches share.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct PolylineFoot {
  std::size_t segment = 0;
  double t = 0;  // in the segment, in [0, 1]
  Vec3 point;
  double distance = std::numeric_limits<double>::infinity();
};

// The nearest point of a polyline of at least two points, on segments first to last; the first of several.
inline PolylineFoot nearest_on_polyline(const std::vector<Vec3>& line, const Vec3& p, std::size_t first = 0,
                                        std::size_t last = std::numeric_limits<std::size_t>::max()) {
  PolylineFoot best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = first; k + 1 < line.size() && k <= last; ++k) {
    const Vec3 edge = line[k + 1] - line[k], d = p - line[k];
    const double squared = norm2(edge);
    const double t = squared > 0 ? std::clamp(dot(d, edge) / squared, 0.0, 1.0) : 0.0;
    const double distance = norm2(d - t * edge);
    if (distance < least) {
      least = distance;
      best.segment = k;
      best.t = t;
    }
  }
  best.point = line[best.segment] + best.t * (line[best.segment + 1] - line[best.segment]);
  best.distance = norm(p - best.point);
  return best;
}

inline double polyline_length(const std::vector<Vec3>& line) {
  double length = 0;
  for (std::size_t k = 0; k + 1 < line.size(); ++k) length += norm(line[k + 1] - line[k]);
  return length;
}

// Linear interpolation of values at a polyline's points.
inline double value_at(const std::vector<double>& values, const PolylineFoot& foot) {
  return (1 - foot.t) * values[foot.segment] + foot.t * values[foot.segment + 1];
}

// The value that a share of them is not above; 0 if there are none.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The median; of an even number of values the upper of the two in the middle. There has to be one at least.
inline double upper_median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// `count` points (at least 2), evenly along the line.
std::vector<Vec3> resample_polyline(const std::vector<Vec3>& line, std::size_t count);

}  // namespace bisector
