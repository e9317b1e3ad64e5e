// Branches that lead from what is known of a tree to the points that it does not explain.
#pragma once

#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "tree/limb.h"

namespace bisector {

struct GrowthOptions {
  double tolerance = 0;        // distance from an axis within which it explains points
  std::vector<double> radius;  // of the branch at each point, as far as it is known: it is explained up to twice that,
                               // for ways run along one side; empty: nothing is known
  std::vector<Index> group;    // of each point: ways stay within a group, and reach none of kNone; empty: all are one
  std::vector<char> wood;      // whether each point is wood rather than a leaf: ways lead to wood, across leaves where
                               // they must; empty: all are
};

// Points are reached by ways that sum up the squares of their steps (Hwang, Damelin and Hero, Shortest path through
// random points, Ann. Appl. Probab. 2016): these follow rows of points, however dense or sparse, and cross gaps where
// they are narrow. All such ways run along edges of the Gabriel graph, so the Delaunay triangulation holds them, with
// no number of neighbours to choose and no parts to join.
//
// `limb_of` is the limb that explains each point (kNone: none), from which ways start; in groups where no point has one
// they start at the lowest, on a new trunk. The longest way is a branch, then the longest of the rest, and so on, as
// long as a branch explains at least a few points that no other does, and not most of it crosses gaps. New limbs have
// no radii and are appended; limbs that end where a way begins go on along it. `limb_of` is brought up to date.
void grow_limbs(const std::vector<Vec3>& points, const GrowthOptions& options, std::vector<Limb>& limbs,
                std::vector<Index>& limb_of, const Context& context = {});

}  // namespace bisector
