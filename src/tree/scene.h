// What the points of a scan show: the ground, walls, low plants, and trees that are told from each other.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/context.h"
#include "bisector/tree.h"
#include "core/geometry.h"
#include "tree/ground.h"

namespace bisector {

struct SceneDivision {
  std::vector<ScanPart> part;  // of each point
  std::vector<Index> tree;     // of each point of a tree; kNone: of the others
  std::vector<Index> base;     // of each tree a point at the foot of its stem; kNone: no stem was found
  HeightField surface;         // of the ground, if it was found
  double height = 0;           // of the ground, if it was given; NaN: it is not known
  std::size_t walls = 0;
  double ground_noise = 0;

  double ground_at(const Vec3& p) const;  // NaN: not known
};

// Divides the points as `options` ask: with `ground` given or found, and, for a scene, walls and trees. Trees are
// numbered by the number of their points, largest first. Where no scene is asked for there is one tree, with all that
// no low plant is; so it is where there is no ground. Throws Error where nothing but ground, or no tree is found.
SceneDivision divide_scene(const std::vector<Vec3>& points, const TreeOptions& options, const Context& context);

}  // namespace bisector
