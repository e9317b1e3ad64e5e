// How well a reconstruction found the branches of a tree.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/tree.h"
#include "support/tree_growth.h"
#include "support/tree_scan.h"

namespace bisector::test {

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

// The same for a sparse scan. Branches count that have five points and a free axis longer than 3 times the median
// distance of these points from the nearest other one; of it counts what has points of the branch within 3 times that
// distance, or 3 deviations of points (noise and the beam's radius) if that is more, off the surface. Axes are near
// within one radius or 2 deviations. Where the parent does not count, ancestors up to the next one that does are as
// right.
struct ScanScore : TreeScore {
  double thick_radius_error = 0;  // radius_error where the true radius is over 2 deviations
  double volume_error = 0;        // of the wood, relative, with its sign
};
ScanScore score_scan(const TreeScan& scan, const std::vector<AxisBranch>& found);

struct LeafScore {
  double precision = 0, recall = 0;  // 1 where nothing is called a leaf, or nothing is one
};
LeafScore score_leaves(const TreeScan& scan, const std::vector<char>& is_leaf);

// What can be measured where no truth is known.
struct SurfaceScore {
  double near_points = 0;   // share of the points within 1 % of the scan's height of the surface
  double bare_area = 0;     // share of the surface farther than 2 % of the height from all points
  double allometric = 0;    // volume over pi / 2 times the trunk's squared radius at 1.3 m times the height
  std::size_t thicker = 0;  // branches that are thicker than the parent where they leave it
};
// `metre`: its length in the points' unit.
SurfaceScore score_surfaces(const std::vector<Vec3>& points, const TreeResult& tree, double metre = 1);

std::vector<AxisBranch> axes_of(const TreeResult& tree);
double wood_volume(const std::vector<AxisBranch>& branches);  // of the free parts

}  // namespace bisector::test
