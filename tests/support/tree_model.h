// A generated tree whose branches are known, scanned with noise and occlusion, and how well a reconstruction found
// them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry.h"

namespace bisector::test {

// A branch as its axis from a point on its parent's axis (a trunk: from the ground) to the tip.
struct AxisBranch {
  std::vector<Vec3> axis;
  std::vector<double> radii;  // one for each point of the axis
  Index parent = kNone;       // branch; kNone: a trunk
};

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

// A trunk, boughs and twigs on curved axes. Radii follow a pipe model, r^2.3 adding up over the branches beyond
// (Leonardo's rule has the exponent 2), so children are thinner than their parents; at every fork the branch that
// goes on is also the longest path to a tip; branches that are not each other's parent keep a distance. Points lie on
// the parts of the surfaces that are not inside other branches, the denser the nearer and the more face on one of
// three scanners around the tree sees them. Half of what is missing is in balls of 0.5 to 1.5 % of the height in
// radius, half are sides of 140 degrees over 3 to 12 % of the height.
TreeModel make_tree(const TreeModelOptions& options = {});

// The free part of a branch's axis is what lies outside its parent (farther from the parent's axis than its radius).
// An axis is near another's point if it passes within `reach` radii there, or within `noise` if that is more. A true
// branch is found if a single found branch's axis is near 70 % of its free axis, and has the right parent if most of
// the free axis of that found branch's parent is near the true parent's axis (the trunk's: if the found branch has
// none). With the reach 1 found axes run inside the branch; with 0.5 they also have to be accurate.
struct TreeScore {
  std::size_t branches = 0;      // true ones whose free axis is longer than 3 radii where it begins
  std::size_t found = 0;         // of them
  std::size_t right_parent = 0;  // of them, found with the right parent
  std::size_t spurious = 0;      // found branches of which less than half the free axis is near true axes
  double covered = 0;            // share of the true branches' free axes that is near found ones
  double radius_error = 0;       // median of the relative error where true branches are near the axes that found them
  double axis_median = 0, axis_mean = 0;  // distance of the found free axes from the true ones, in the true radii there
  std::size_t roots = 0;                  // found branches without a parent
  bool loops = false;                     // among the found parents, or a parent that does not exist
};
TreeScore score_tree(const std::vector<AxisBranch>& truth, const std::vector<AxisBranch>& found, double noise,
                     double reach = 0.5);

}  // namespace bisector::test
