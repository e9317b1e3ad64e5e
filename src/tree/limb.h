// A branch while it is being made.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

struct Limb {
  std::vector<Vec3> axis;     // at least 2 points; the first lies on the parent's axis
  std::vector<double> radii;  // of each, not increasing
  Index parent = kNone;       // limb, of a lower number; kNone: a trunk
  std::vector<Index> points;  // that belong to it, ascending
  std::vector<char> fitted;   // of each point of the axis: whether its radius rests on points around it
};

}  // namespace bisector
