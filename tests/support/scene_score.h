// How well a scene was divided into ground, walls and trees, and its trees were made.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/tree.h"
#include "support/scene_scan.h"

namespace bisector::test {

struct Shares {
  double precision = 1, recall = 1;  // 1 where nothing is called so, or nothing is
};

struct SceneScore {
  Shares ground, wall;
  std::size_t trees = 0;        // true ones
  std::size_t found_trees = 0;  // in the result
  double right_tree = 0;        // share of the trees' points that are in the tree that has most of their true one
  double bushes_in_trees = 0;   // share of the bushes' points
  std::vector<Index> match;     // of each true tree the found one that has most of its points; kNone: none
};
SceneScore score_scene(const SceneScan& scan, const TreeResult& result);

// The axes of one of the trees of a result.
std::vector<AxisBranch> axes_of_tree(const TreeResult& result, Index tree);

}  // namespace bisector::test
