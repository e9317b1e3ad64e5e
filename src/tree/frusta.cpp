#include "tree/frusta.h"

#include <cmath>
#include <numbers>

#include "tree/polyline.h"

namespace bisector {

double Frustum::volume() const {
  const double r = start_radius, q = end_radius;
  return std::numbers::pi / 3 * height * (r * r + r * q + q * q);
}

double Frustum::lateral_area() const {
  return std::numbers::pi * (start_radius + end_radius) * std::hypot(height, start_radius - end_radius);
}

std::vector<Frustum> frusta_outside(const std::vector<Vec3>& axis, const std::vector<double>& radii,
                                    const std::vector<Vec3>& parent_axis, const std::vector<double>& parent_radii) {
  const auto depth = [&](const Vec3& p) {
    const PolylineFoot foot = nearest_on_polyline(parent_axis, p);
    return value_at(parent_radii, foot) - foot.distance;
  };
  std::vector<Frustum> frusta;
  bool free = parent_axis.empty();
  for (std::size_t k = 0; k + 1 < axis.size(); ++k) {
    double share = 1;  // of the segment
    if (!free) {
      const double here = depth(axis[k]), next = depth(axis[k + 1]);
      if (next > 0) continue;
      free = true;
      share = here > 0 ? -next / (here - next) : 1;
    }
    frusta.push_back({k, share * axis[k] + (1 - share) * axis[k + 1], axis[k + 1], share * norm(axis[k + 1] - axis[k]),
                      share * radii[k] + (1 - share) * radii[k + 1], radii[k + 1]});
  }
  return frusta;
}

}  // namespace bisector
