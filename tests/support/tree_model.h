// A generated tree whose branches are known, densely scanned with noise and occlusion.
#pragma once

#include <cstdint>
#include <vector>

#include "support/tree_growth.h"

namespace bisector::test {

struct TreeModelOptions {
  std::size_t points = 100'000;  // about
  double noise = 0.002;          // standard deviation in each coordinate, of the tree's height
  double occlusion = 0.2;        // share of the surface's samples that are missing
  std::size_t boughs = 16;       // branches on the trunk
  std::size_t twigs = 4;         // branches on each of them, at most
  std::uint64_t random_seed = 1;
};

struct TreeModel {
  std::vector<Vec3> points;
  std::vector<AxisBranch> branches;  // parents before children; the first is the trunk
  double height = 0;                 // z is up
  double noise = 0;                  // standard deviation in each coordinate, in the unit of the points
};

// A tree of 10 m (grow_tree). Points lie on the parts of the surfaces that are not inside other branches, the denser
// the nearer and the more face on one of three scanners around the tree sees them. Half of what is missing is in balls
// of 0.5 to 1.5 % of the height in radius, half are sides of 140 degrees over 3 to 12 % of the height.
TreeModel make_tree(const TreeModelOptions& options = {});

}  // namespace bisector::test
