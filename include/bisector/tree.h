// Reconstruction of the branches of a tree from a laser scan, dense or sparse (Yan Dong-Ming, Variational Shape
// Segmentation and Mesh Generation, 2010, chapter 3; where points carry no radius, the pipe model of Shinozaki et al.,
// 1964).
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "bisector/context.h"
#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

enum class TreeComponents {
  bridge,   // parts of the scan that are apart are joined over their gaps
  separate  // each becomes a tree of its own
};

enum class TreeLeaves {
  keep,  // all points are taken for wood
  apart  // points of no branch are told from wood and left out
};

// What a point of a scan shows.
enum class ScanPart : std::uint8_t {
  tree,       // a branch or a leaf
  ground,     // or what is below it
  wall,       // a large upright plane, or what a LAS file says is a building
  low_plant,  // what is low and at no stem: grass, bushes
  stray       // what no short steps lead to from a tree, or too little for one
};

struct TreeOptions {
  std::size_t clusters = 0;            // at most; 0: as many as it takes
  double delta = 0.004;                // a cluster is a cylinder if its points lie so near one, rms, in the unit cube
  std::size_t max_cluster_points = 0;  // larger clusters are split; 0: only those that are no cylinders
  double ground = -std::numeric_limits<double>::infinity();  // points below this height (z) are left out
  bool find_ground = false;           // find the ground, unless `ground` gives it, and leave it out, with low plants
  bool scene = false;                 // find it, walls and low plants, leave them out, and make each tree for itself
  std::vector<std::uint8_t> classes;  // of each point, of a LAS file (2: ground, 6: building); empty: not known
  TreeComponents components = TreeComponents::bridge;
  TreeLeaves leaves = TreeLeaves::keep;
  double tip_radius = 0;  // of the thinnest twigs, in the points' unit; 0: 0.0003 of the largest extent
};

// Clamped, parameter in [0, 1] (others are clamped to it). Degree 3, less where there are fewer than four control
// points.
struct BSplineCurve {
  int degree = 3;
  std::vector<double> knots;  // control points + degree + 1, ascending
  std::vector<Vec3> control;

  BISECTOR_API Vec3 point(double t) const;
  BISECTOR_API Vec3 derivative(double t) const;
  BISECTOR_API Vec3 second_derivative(double t) const;
};

// A closed surface of circular sections across an axis. Cubic in u (clamped) along the branch: [-1, 0] is the flat disk
// at the base, from its centre outwards, [0, 1] the wall over the axis' parameter, [1, 2] the rounded tip; in [-1, 0]
// and [1, 2] the first and last row are one point. Cubic in v (periodic: the last 3 columns repeat the first 3) around
// the axis from 0 to 1. The normal, the derivative in u times that in v, points outwards. Control point (i, j) is
// control[i * columns + j].
struct BranchSurface {
  BSplineCurve axis;                             // cubic
  std::vector<double> radius_parameters, radii;  // the radius is piecewise linear in the axis' parameter
  std::size_t rows = 0, columns = 0;
  std::vector<double> knots_u, knots_v;  // rows + 4, columns + 4
  std::vector<Vec3> control;

  BISECTOR_API Vec3 point(double u, double v) const;
  BISECTOR_API double radius(double t) const;  // of the table, at an axis parameter
};

// A point of the final skeleton, on the axis of a branch. Nodes come parents first.
struct TreeNode {
  Vec3 position;
  double radius = 0;
  Index parent = kNone;  // node; kNone: a root
  Index branch = 0;
  bool fitted = false;  // the radius rests on points around it, else on the pipe model
};

struct TreeBranch {
  std::vector<Index> nodes;                // from the root on the parent's axis (or the ground) to the tip
  Index parent = kNone;                    // branch, of a lower number; kNone: a trunk
  int order = 0;                           // 0: trunk, 1: branches on it, ...
  double length = 0;                       // of the axis
  double fitted_length = 0;                // of it, where the radius rests on points
  double base_radius = 0, tip_radius = 0;  // where the branch leaves its parent's surface, and at its end
  double volume = 0, area = 0;             // of what is outside the parent, as cone frusta along the axis
  std::size_t points = 0;                  // that belong to it
  BranchSurface surface;
};

// One of the trees of a scan.
struct ScannedTree {
  Index trunk = 0;  // branch; that of the next tree, or the end, ends its branches
  Vec3 base;        // where the trunk's axis begins
  double ground = std::numeric_limits<double>::quiet_NaN();  // height (z) of the ground there; NaN: not known
  double height = 0;  // of its highest point above the ground, or, where that is not known, above its lowest point
  std::size_t points = 0, branches = 0;
  double length = 0, volume = 0, area = 0;  // of its branches
  double noise = 0, pipe_exponent = 0;      // as in TreeResult
  bool pipe_fitted = false;
};

struct TreeSeconds {
  double scene = 0, graph = 0, clusters = 0, skeleton = 0, refine = 0, surfaces = 0, total = 0;
};

struct TreeResult {
  // Of each point; kNone: none. A duplicate has its twin's.
  std::vector<Index> cluster, branch;
  std::vector<ScanPart> part;                    // of each point; empty: with neither find_ground nor scene
  std::vector<Index> tree;                       // of a scene's points, in `trees`; kNone: none; empty: no scene
  std::vector<char> leaf;                        // whether each point is a leaf; empty: leaves were not looked for
  std::size_t clusters = 0, fixed_clusters = 0;  // in all; tight cylinders
  std::vector<TreeNode> skeleton;
  std::vector<TreeBranch> branches;        // parents before children
  std::size_t components = 0;              // of the scan
  std::vector<double> bridges;             // lengths of the shortest gaps between them, if they were bridged
  std::vector<ScannedTree> trees;          // one; of a scene, or with components apart, one for each trunk
  std::size_t ground_points = 0;           // of the ground or below it, left out
  std::size_t walls = 0, wall_points = 0;  // left out
  std::size_t low_plant_points = 0, stray_points = 0;  // left out
  double ground_noise = 0;                 // standard deviation of the ground's points off it, if it was looked for
  std::size_t duplicate_points = 0;        // at the place of another
  std::size_t small_component_points = 0;  // in components too small for a tree of their own, left out
  std::size_t leaf_points = 0;             // with TreeLeaves::apart, left out
  std::size_t unexplained_points = 0;      // near no branch: strays, and leaves where they are not left out
  // p of the pipe model: at a fork r^p of what comes in is the sum over what goes out. `pipe_fitted`: from this tree's
  // radii that rest on points; else there were too few, and it is 2.3. Of a scene, like `noise`, that of the first
  // tree.
  double pipe_exponent = 0;
  bool pipe_fitted = false;
  double noise = 0;  // standard deviation of points off thick branches
  TreeSeconds seconds;
};

// `points`: z is up; any unit and origin. The same result for any number of threads. Throws Error for coordinates that
// are not finite, fewer than 20 distinct points (above the ground), points that all lie on one line, options out of
// range, points that are all ground and, of a scene, where no tree is found.
//
// A scan whose ground is looked for and not found, since it is cut off, gives the result that it gives without. Trees
// of a scene come by their number of points, largest first, and `components` is bridge; the branches of each follow
// each other.
BISECTOR_API TreeResult reconstruct_tree(const std::vector<Vec3>& points, const TreeOptions& options = {},
                                         const Context& context = {});

inline constexpr double kTreeTolerance = 0.05;

// The surfaces of all branches; a triangle's label is its branch. Each branch is closed; children reach into their
// parents. `tolerance` is the largest chord error in radii of the branch. Throws Cancelled.
BISECTOR_API TriangleMesh tree_mesh(const TreeResult& tree, double tolerance = kTreeTolerance,
                                    const Context& context = {});
BISECTOR_API TriangleMesh tree_mesh(const TreeResult& tree, const Context& context);

enum class IgesUnit { millimetre, centimetre, metre, inch, foot };  // of the coordinates

// The surfaces as .obj (a group branch_K for each branch K), .ply (face property `label`), .off, .stl or, as B-spline
// surfaces named branch_K, .igs and .iges, where `unit` is that of the coordinates. Throws Error.
BISECTOR_API void write_tree(const std::string& path, const TreeResult& tree, const TriangleMesh& mesh,
                             IgesUnit unit = IgesUnit::metre);

// The skeleton as binary PLY: vertices with `radius`, `branch` and `order`, and the element `edge`. Throws Error.
BISECTOR_API void write_skeleton(const std::string& path, const TreeResult& tree);

// The branches as cylinders, one for each segment of the skeleton outside the parent branch, as comma-separated lines
// under a head of TreeQSM's names: radius, length, start_x, start_y, start_z, axis_x, axis_y, axis_z (a unit vector),
// parent (the cylinder that this one grows from), extension (the next one of its branch), branch, branch_order (0: of a
// trunk), position_in_branch and added (always 0: there are no cylinders but those of the axes). Lines, branches and
// positions count from 1, and 0 stands for none; parents come before children, and branch K + 1 is branches[K]. A
// cylinder has the length and volume of the cone frustum between its ends, so volumes sum to those of the branches.
// TreeQSM's mad, SurfCov and UnmodRadius are left out. Of a scene there is a last column `tree`, from 1. Numbers read
// back bit for bit. Throws Error.
BISECTOR_API void write_cylinders(const std::string& path, const TreeResult& tree);

// The points as binary PLY with `label`, their branch (-1: none, -2: a leaf, -3: ground, -4: a wall, -5: a low plant),
// and its colour; of a scene also `tree` (-1: none). Throws Error.
BISECTOR_API void write_tree_labels(const std::string& path, const std::vector<Vec3>& points, const TreeResult& tree);

// Points and surfaces side by side, seen from the side, as PNG; branches have the same colours in both. Throws Error.
BISECTOR_API void write_tree_preview(const std::string& path, const std::vector<Vec3>& points, const TreeResult& tree,
                                     const TriangleMesh& mesh);

}  // namespace bisector
