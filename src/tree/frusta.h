// A branch as cone frusta along its axis.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct Frustum {
  std::size_t segment = 0;  // of the axis
  Vec3 start, end;
  double height = 0;
  double start_radius = 0, end_radius = 0;

  double volume() const;
  double lateral_area() const;
};

// One for each segment of the axis (two points at least, each with its radius) from where it leaves the parent's
// surface; the first begins there. None if it stays inside. Without a parent, which then has no points, all of them.
std::vector<Frustum> frusta_outside(const std::vector<Vec3>& axis, const std::vector<double>& radii,
                                    const std::vector<Vec3>& parent_axis = {},
                                    const std::vector<double>& parent_radii = {});

}  // namespace bisector
