// Walls in a scan: large vertical planes.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"

namespace bisector {

struct Walls {
  std::vector<Index> wall;  // of each point; kNone: of none
  std::size_t count = 0;
};

// Planes are grown over the means of small cubes, from where their surroundings are flattest outwards (region growing;
// Rabbani, van den Heuvel and Vosselman, Segmentation of point clouds using smoothness constraint, ISPRS XXXVI-5,
// 2006). One is a wall if it stands upright, is wider and higher than twice the diameter of the stoutest trunk that a
// tree of this `height` can have, a tenth of it, and fills at least half of its rectangle. Its points are those off it
// by no more than so many can be by their noise. The same for any number of threads.
Walls find_walls(const std::vector<Vec3>& points, double height, const Context& context = {});

}  // namespace bisector
