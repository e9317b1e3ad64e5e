// Branches of a skeleton: the longest paths (thesis 3.3.3, Algorithm 3.3.1).
#pragma once

#include <vector>

#include "core/geometry.h"
#include "tree/skeleton.h"

namespace bisector {

struct SkeletonBranch {
  std::vector<Index> nodes;  // from the one on the parent branch (or the root) to the tip, at least 2
  Index parent = kNone;      // branch; kNone: a trunk
};

// Nodes come parents first, and so do the branches, those of a branch in the order of its nodes. At a fork the longest
// path goes on, unless another one that is not much shorter is straighter and thicker.
std::vector<SkeletonBranch> find_branches(const std::vector<SkeletonNode>& nodes);

}  // namespace bisector
