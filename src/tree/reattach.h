// Branches that shortest paths have joined wrongly: where branches touch and over gaps of the scan.
#pragma once

#include <vector>

#include "core/geometry.h"
#include "tree/refine.h"

namespace bisector {

// `limbs` are fitted, in any order, with radii as fitted. Limbs that start far from their parent's surface go to the
// parent that they lead back to over a smaller and straighter gap. Where a child goes on straighter and thicker than
// its parent after the fork it becomes the rest of the branch, and what the rest was a child. There are no loops after
// it either.
void reattach_limbs(const std::vector<Vec3>& points, double noise, std::vector<Limb>& limbs);

}  // namespace bisector
