// Reconstruction of the branches of a leafless tree from a laser scan (thesis chapter 3).
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "tree/loft.h"

namespace bisector {

enum class TreeComponents {
  bridge,   // parts of the scan that are apart are joined over their gaps
  separate  // each becomes a tree of its own
};

struct TreeOptions {
  std::size_t clusters = 0;            // at most; 0: as many as it takes
  double delta = 0.004;                // a cluster is a cylinder if its points lie so near one, rms, in the unit cube (thesis 3.2.3)
  std::size_t max_cluster_points = 0;  // larger clusters are split; 0: only those that are no cylinders
  double ground = -std::numeric_limits<double>::infinity();  // points below this height (z) are left out
  TreeComponents components = TreeComponents::bridge;
};

// A point of the final skeleton, on the axis of a branch. Nodes come parents first.
struct TreeNode {
  Vec3 position;
  double radius = 0;
  Index parent = kNone;  // node; kNone: a root
  Index branch = 0;
};

struct TreeBranch {
  std::vector<Index> nodes;  // from the root on the parent's axis (or the ground) to the tip
  Index parent = kNone;      // branch, of a lower number; kNone: a trunk
  int order = 0;             // 0: trunk, 1: branches on it, ...
  double length = 0;         // of the axis
  double base_radius = 0, tip_radius = 0;  // where the branch leaves its parent's surface, and at its end
  double volume = 0, area = 0;             // of what is outside the parent, as cone frusta along the axis
  std::size_t points = 0;    // that belong to it
  BranchSurface surface;
};

struct TreeSeconds {
  double graph = 0, clusters = 0, skeleton = 0, refine = 0, surfaces = 0, total = 0;
};

struct TreeResult {
  // Of each point; kNone: none. A duplicate has its twin's.
  std::vector<Index> cluster, branch;
  std::size_t clusters = 0, fixed_clusters = 0;  // in all; tight cylinders
  std::vector<TreeNode> skeleton;
  std::vector<TreeBranch> branches;    // parents before children
  std::size_t components = 0;          // of the scan
  std::vector<double> bridges;         // lengths of the shortest gaps between them, if they were bridged
  std::size_t ground_points = 0;       // below the ground, left out
  std::size_t duplicate_points = 0;    // at the place of another
  std::size_t small_component_points = 0;  // in components too small for a tree of their own, left out
  double noise = 0;                    // standard deviation of points off thick branches
  TreeSeconds seconds;
};

// `points`: z is up; any unit and origin. The same result for any number of threads. Throws Error for coordinates that
// are not finite, fewer than 20 distinct points (above the ground), points that all lie on one line, and options out of
// range.
TreeResult reconstruct_tree(const std::vector<Vec3>& points, const TreeOptions& options = {}, const Context& context = {});

// The surfaces of all branches; a triangle's label is its branch. Each branch is closed; children reach into their
// parents. `tolerance` is the largest chord error in radii of the branch.
TriangleMesh tree_mesh(const TreeResult& tree, double tolerance = 0.05);

}  // namespace bisector
