// How vertices on the boundary of a tetrahedral mesh may move.
#pragma once

#include <functional>

#include "core/geometry.h"

namespace bisector {

struct TetSlide {
  // The nearest point to `wanted` on what the vertex may slide on: the surface, a feature curve, or its own position.
  // `vertex` as in the mesh given. Empty: vertices on the boundary are fixed.
  std::function<Vec3(Index vertex, const Vec3& wanted)> project = {};
  double min_angle = 25;  // degrees; no triangle of the boundary gets an angle below this, or smaller than it was
  double max_turn = 15;   // degrees; no such triangle's normal turns by more from where it was at first
};

}  // namespace bisector
