// Branches that lead from what is known of a tree to the points that it does not explain.
#pragma once

#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "tree/limb.h"

namespace bisector {

// Points are reached by ways that sum up the squares of their steps (Hwang, Damelin and Hero, Shortest path through
// random points, Ann. Appl. Probab. 2016): these follow rows of points, however dense or sparse, and cross gaps where
// they are narrow. All such ways run along edges of the Gabriel graph, so the Delaunay triangulation holds them, with
// no number of neighbours to choose and no parts to join.
//
// `limb_of` is the limb that explains each point (kNone: none), from which ways start; where no point has one they
// start at the lowest of all, on a new trunk. The longest way is a branch, then the longest of the rest, and so on, as
// long as a branch explains at least a few points farther than `tolerance` from all others. Ways run along one side of a
// branch, so where `radius`, what the branch at each point is thought to be thick, is given, it explains what is within
// twice that besides. New limbs have no radii and
// are appended; `limb_of` has them where they are within the tolerance.
void grow_limbs(const std::vector<Vec3>& points, const std::vector<double>& radius, double tolerance,
                std::vector<Limb>& limbs, std::vector<Index>& limb_of, const Context& context = {});

}  // namespace bisector
