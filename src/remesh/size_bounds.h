// What runs ask of the sizes in those after them.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

// Edges at these points must not be longer than these lengths, in the mesh's unit.
struct SizeBounds {
  std::vector<Vec3> points;
  std::vector<double> lengths;

  void add(const SizeBounds& others) {
    points.insert(points.end(), others.points.begin(), others.points.end());
    lengths.insert(lengths.end(), others.lengths.begin(), others.lengths.end());
  }
};

}  // namespace bisector
