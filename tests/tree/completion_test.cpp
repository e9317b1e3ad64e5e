// What carries a radius, the pipe model, ways to points, and whole trees from sparse scans.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bisector/tree.h"
#include "core/random.h"
#include "support/tree_scan.h"
#include "support/tree_score.h"
#include "tree/allometry.h"
#include "tree/coverage.h"
#include "tree/growth.h"
#include "tree/polyline.h"
#include "tree/support.h"
#include "tree/trim.h"
#include "tree/wood.h"

namespace bisector {
namespace {

// A limb along z from `z`, with points of the axis a tenth apart.
Limb upright(double z, double length, double radius) {
  Limb limb;
  const auto count = static_cast<std::size_t>(length * 10 + 0.5) + 1;
  for (std::size_t k = 0; k < count; ++k) limb.axis.push_back({0, 0, z + 0.1 * static_cast<double>(k)});
  limb.radii.assign(count, radius);
  limb.fitted.assign(count, 0);
  return limb;
}

// Points about the axis at distances from it, up to an angle around it.
std::vector<Vec3> around(double length, double least, double most, double angle, std::size_t count) {
  Random random(7);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    // Even over the area across the axis.
    const double r = std::sqrt(least * least + (most * most - least * least) * random.uniform());
    const double a = angle * random.uniform();
    points.push_back({r * std::cos(a), r * std::sin(a), length * random.uniform()});
  }
  return points;
}

std::size_t supported(const std::vector<Vec3>& points, Limb limb, double noise) {
  for (std::size_t i = 0; i < points.size(); ++i) limb.points.push_back(static_cast<Index>(i));
  const std::vector<char> result = supported_radii(points, limb, noise);
  return static_cast<std::size_t>(std::count(result.begin(), result.end(), 1));
}

TEST(Support, PointsOnASurfaceCarryItsRadiusCloudsDoNot) {
  const double pi = std::numbers::pi;
  const Limb limb = upright(0, 2, 0.2);
  EXPECT_EQ(supported(around(2, 0.19, 0.21, 2 * pi, 2000), limb, 0), limb.axis.size());
  EXPECT_EQ(supported(around(2, 0.19, 0.21, 0.8 * pi, 2000), limb, 0), limb.axis.size());  // seen from one side
  EXPECT_EQ(supported(around(2, 0.19, 0.21, 0.3 * pi, 2000), limb, 0), 0u);                // a strip
  EXPECT_EQ(supported(around(2, 0, 0.3, 2 * pi, 2000), limb, 0), 0u);                      // twigs in a tube
  EXPECT_EQ(supported(around(2, 0.19, 0.21, 2 * pi, 20), limb, 0), 0u);                    // too few
  // What is off by as much as the noise may still be a thin branch.
  EXPECT_EQ(supported(around(2, 0.1, 0.3, 2 * pi, 2000), limb, 0), 0u);
  EXPECT_EQ(supported(around(2, 0.1, 0.3, 2 * pi, 2000), limb, 0.06), limb.axis.size());
}

TEST(Support, MeasuresTheNoise) {
  Random random(3);
  Limb limb = upright(0, 2, 0.2);
  limb.fitted.assign(limb.axis.size(), 1);
  std::vector<Vec3> points;
  for (Index i = 0; i < 4000; ++i) {
    const double gauss = std::sqrt(-2 * std::log(1 - random.uniform())) * std::cos(6.283185307 * random.uniform());
    const double r = 0.2 + 0.01 * gauss, a = 6.283185307 * random.uniform();
    points.push_back({r * std::cos(a), r * std::sin(a), 2 * random.uniform()});
    limb.points.push_back(i);
  }
  EXPECT_NEAR(surface_noise(points, {limb}), 0.01, 0.001);
  limb.fitted.assign(limb.axis.size(), 0);
  EXPECT_EQ(surface_noise(points, {limb}), 0);
}

TEST(Trim, EndsWhereNoRadiusIsCarriedAndBridgesShortGaps) {
  Limb trunk = upright(0, 4, 0.1);
  for (std::size_t k = 0; k < 30; ++k) trunk.fitted[k] = k < 10 || k >= 18;  // a gap of 0.8, 8 radii
  EXPECT_EQ(fitted_end(trunk, 0), 30u);
  for (double& r : trunk.radii) r = 0.05;  // 16 radii
  EXPECT_EQ(fitted_end(trunk, 0), 10u);

  Limb child = upright(0, 1, 0.05), high = child, bare = child;
  for (Limb* limb : {&child, &high}) limb->fitted.assign(limb->axis.size(), 1);
  for (Limb* limb : {&child, &high, &bare}) limb->parent = 0;
  child.axis.front().z = 0.5;
  high.axis.front().z = 2.5;  // on what goes
  std::vector<Limb> limbs{trunk, child, high, bare};
  trim_limbs(limbs);
  ASSERT_EQ(limbs.size(), 2u);
  EXPECT_EQ(limbs[0].axis.size(), 10u);
  EXPECT_EQ(limbs[1].axis.front().z, 0.5);
  EXPECT_EQ(limbs[1].parent, 0u);
}

// A trunk that forks into two at its end, each into two again.
std::vector<Limb> forks() {
  std::vector<Limb> limbs{upright(0, 4, 0.1)};
  const auto add = [&](Index parent, const Vec3& from, const Vec3& to) {
    Limb limb;
    for (int k = 0; k <= 10; ++k) limb.axis.push_back(from + 0.1 * k * (to - from));
    limb.radii.assign(limb.axis.size(), 0);
    limb.fitted.assign(limb.axis.size(), 0);
    limb.parent = parent;
    limbs.push_back(limb);
  };
  add(0, {0, 0, 4}, {2, 0, 6});
  add(0, {0, 0, 4}, {-1, 0, 6});
  add(1, {2, 0, 6}, {3, 1, 8});
  add(1, {2, 0, 6}, {3, -1, 7});
  return limbs;
}

TEST(PipeModel, AddsUpAtForksAndFallsTowardsTips) {
  std::vector<Limb> limbs = forks();
  for (std::size_t k = 0; k < 5; ++k) limbs[0].fitted[k] = 1;
  const PipeModel model = fill_radii(limbs, 0, 80);
  EXPECT_FALSE(model.from_points);
  const auto flow = [&](double r) { return std::pow(r, model.exponent); };
  EXPECT_EQ(limbs[0].radii[0], 0.1);  // rests on points
  EXPECT_NEAR(flow(limbs[1].radii[0]) + flow(limbs[2].radii[0]), flow(limbs[0].radii.back()), 1e-12);
  EXPECT_NEAR(flow(limbs[3].radii[0]) + flow(limbs[4].radii[0]), flow(limbs[1].radii.back()), 1e-12);
  for (const Limb& limb : limbs)
    for (std::size_t k = 1; k < limb.radii.size(); ++k) EXPECT_LE(limb.radii[k], limb.radii[k - 1]);
  // The last twigs are as thick as is asked for at least, but no thicker than what they grow on.
  fill_radii(limbs, 0.09, 80);
  for (const Limb& limb : limbs)
    for (const double r : limb.radii) EXPECT_GE(r, std::min(0.09, limbs[0].radii.back()) * (1 - 1e-12));
}

TEST(PipeModel, FindsTheExponent) {
  for (const double p : {2.0, 2.5, 3.0}) {
    std::vector<Limb> limbs = forks();
    fill_radii(limbs, 0, 80);  // the default's; their ratios tell the lengths beyond
    for (Limb& limb : limbs) {
      for (double& r : limb.radii) r = std::pow(r, 2.3 / p);
      limb.fitted.assign(limb.axis.size(), 1);
    }
    const PipeModel model = fill_radii(limbs, 0, 80);
    EXPECT_TRUE(model.from_points);
    EXPECT_NEAR(model.exponent, p, 0.02);
  }
}

TEST(PipeModel, WithoutAnyRadiusTheSizeTellsTheTrunks) {
  std::vector<Limb> limbs = forks();
  fill_radii(limbs, 0, 50);
  EXPECT_NEAR(limbs[0].radii[0], 8.0 / 50, 1e-12);
  // Each tree's own size, however far they are apart.
  const std::size_t n = limbs.size();
  for (const Limb& limb : forks()) {
    limbs.push_back(limb);
    for (Vec3& p : limbs.back().axis) p += Vec3{1000, 0, 0};
    if (limb.parent != kNone) limbs.back().parent += static_cast<Index>(n);
  }
  fill_radii(limbs, 0, 50);
  EXPECT_NEAR(limbs[0].radii[0], 8.0 / 50, 1e-12);
  EXPECT_NEAR(limbs[n].radii[0], 8.0 / 50, 1e-10);
}

// Rows of points: a stem, a bough at a right angle after a gap, and a stray.
TEST(Growth, FollowsRowsAndLeavesStraysAlone) {
  std::vector<Vec3> points;
  for (int k = 0; k <= 70; ++k) points.push_back({0.001 * (k % 3), 0, 0.02 * k});
  for (int k = 4; k <= 30; ++k) points.push_back({0.02 * k, 0.001 * (k % 2), 0.5});
  points.push_back({0.5, 0.5, 0.9});
  std::vector<Limb> limbs;
  std::vector<Index> limb_of(points.size(), kNone);
  grow_limbs(points, {0.01, {}, {}, {}}, limbs, limb_of);
  ASSERT_EQ(limbs.size(), 2u);
  EXPECT_EQ(limbs[0].parent, kNone);
  EXPECT_EQ(limbs[1].parent, 0u);
  for (std::size_t i = 0; i + 1 < points.size(); ++i) EXPECT_EQ(limb_of[i], i > 70 ? 1u : 0u) << i;
  EXPECT_EQ(limb_of.back(), kNone);
  for (const Limb& limb : limbs)
    for (const Vec3& p : limb.axis) {
      const bool in_gap = p.x > 0.003 && p.x < 0.08;  // which may be crossed at an angle
      EXPECT_LT(std::min(std::hypot(p.x, p.y), std::hypot(p.y, p.z - 0.5)), in_gap ? 0.04 : 0.005);
    }
}

TEST(Growth, WaysLeadToWoodAndAcrossLeaves) {
  std::vector<Vec3> points;
  for (int k = 0; k <= 30; ++k) points.push_back({0, 0, 0.02 * k});
  for (int k = 1; k <= 10; ++k) points.push_back({0.02 * k, 0, 0.3});  // a row aside
  std::vector<char> wood(points.size(), 1);
  for (std::size_t i = 31; i < wood.size(); ++i) wood[i] = 0;  // of leaves
  wood[10] = 0;
  std::vector<Limb> limbs;
  std::vector<Index> limb_of(points.size(), kNone);
  grow_limbs(points, {0.01, {}, {}, wood}, limbs, limb_of);
  ASSERT_EQ(limbs.size(), 1u);
  EXPECT_NEAR(polyline_length(limbs[0].axis), 0.6, 0.01);
  EXPECT_EQ(limb_of[10], 0u);
  EXPECT_EQ(limb_of.back(), kNone);
}

TEST(Growth, GroupsAreTreesOfTheirOwn) {
  std::vector<Vec3> points;
  std::vector<Index> group;
  for (int tree = 0; tree < 3; ++tree)
    for (int k = 0; k <= 20; ++k) {
      points.push_back({0.05 * tree, 0.001 * (k % 2), 0.05 * k});
      group.push_back(tree == 2 ? kNone : static_cast<Index>(tree));
    }
  std::vector<Limb> limbs;
  std::vector<Index> limb_of(points.size(), kNone);
  grow_limbs(points, {0.01, {}, group, {}}, limbs, limb_of);
  ASSERT_EQ(limbs.size(), 2u);
  for (const Limb& limb : limbs) EXPECT_EQ(limb.parent, kNone);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(limb_of[i] == kNone, group[i] == kNone);
}

// Rows of points among as many that lie anywhere: nearly all of the rows are taken, and few of the others.
TEST(Wood, RowsAreToldFromScatter) {
  Random random(5);
  std::vector<Vec3> points;
  constexpr std::size_t kRow = 60, kRows = 8;
  for (std::size_t r = 0; r < kRows; ++r) {
    const Vec3 from{random.uniform(), random.uniform(), random.uniform()};
    const Vec3 way = unit(Vec3{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5});
    for (std::size_t k = 0; k < kRow; ++k) points.push_back(from + 0.02 * static_cast<double>(k) * way);
  }
  const std::size_t rows = points.size();
  const Box box = bounding_box(points);
  for (std::size_t k = 0; k < rows; ++k) {
    Vec3 p;
    for (int c = 0; c < 3; ++c) p[c] = box.lo[c] + random.uniform() * (box.hi[c] - box.lo[c]);
    points.push_back(p);
  }
  const std::vector<char> wood = points_on_lines(points, std::vector<char>(points.size(), 1), 0.01);
  const auto taken = [&](std::size_t first, std::size_t last) {
    return std::count(wood.begin() + static_cast<std::ptrdiff_t>(first),
                      wood.begin() + static_cast<std::ptrdiff_t>(last), 1);
  };
  EXPECT_GE(taken(0, rows), static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(rows)));
  EXPECT_LE(taken(rows, points.size()), static_cast<std::ptrdiff_t>(0.1 * static_cast<double>(rows)));
  EXPECT_EQ(points_on_lines(points, std::vector<char>(points.size(), 0), 0.01), std::vector<char>(points.size(), 1));
}

TEST(SparseTree, LeavesApartLeaveFewerFalseBranches) {
  const test::TreeScan scan = test::scan_tree({.points = 5000, .leaves = 0.3, .random_seed = 6});
  TreeOptions options;
  const TreeResult kept = reconstruct_tree(scan.points, options);
  EXPECT_TRUE(kept.leaf.empty());
  EXPECT_EQ(kept.leaf_points, 0u);
  options.leaves = TreeLeaves::apart;
  const TreeResult apart = reconstruct_tree(scan.points, options);
  ASSERT_EQ(apart.leaf.size(), scan.points.size());
  EXPECT_EQ(apart.leaf_points, static_cast<std::size_t>(std::count(apart.leaf.begin(), apart.leaf.end(), 1)));
  for (std::size_t i = 0; i < apart.leaf.size(); ++i)
    EXPECT_TRUE(!apart.leaf[i] || apart.branch[i] == kNone) << "point " << i;
  // What is left out is mostly leaves, which are not a third of the points.
  EXPECT_GT(test::score_leaves(scan, apart.leaf).precision, 0.6);
  EXPECT_LT(2 * test::score_scan(scan, test::axes_of(apart)).spurious,
            test::score_scan(scan, test::axes_of(kept)).spurious);
}

TEST(Coverage, AreaThatNoPointsShow) {
  TriangleMesh mesh;  // two unit squares, one of them far away
  for (const double x : {0.0, 10.0}) {
    const auto first = static_cast<Index>(mesh.vertices.size());
    for (const Vec3& p : {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{1, 1, 0}, Vec3{0, 1, 0}})
      mesh.vertices.push_back(p + Vec3{x, 0, 0});
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  }
  const std::vector<Vec3> centre{{0.5, 0.5, 0}};
  EXPECT_NEAR(bare_area(mesh, centre, 1), 0.5, 0.02);
  EXPECT_NEAR(bare_area(mesh, centre, 0.5), 1 - std::numbers::pi / 8, 0.02);
  EXPECT_EQ(bare_area(mesh, centre, 20), 0);
}

// Trees that are known, as scanners on the ground and on cars see them.
TEST(SparseTree, BranchesRadiiAndVolumeOfKnownTrees) {
  double right = 0, branches = 0, radius_error = 0, volume_error = 0;
  int scans = 0;
  for (const test::ScanPath path : {test::ScanPath::one_side, test::ScanPath::street})
    for (const std::uint64_t seed : {31, 32, 33}) {
      test::TreeScanOptions options;
      options.path = path;
      options.points = 8000;
      options.random_seed = seed;
      const test::TreeScan scan = test::scan_tree(options);
      const TreeResult tree = reconstruct_tree(scan.points);
      const test::ScanScore score = test::score_scan(scan, test::axes_of(tree));
      const test::SurfaceScore surface = test::score_surfaces(scan.points, tree);
      EXPECT_GE(surface.near_points, 0.97);
      EXPECT_LE(surface.bare_area, 0.1);
      right += static_cast<double>(score.right_parent);
      branches += static_cast<double>(score.branches);
      radius_error += score.radius_error;
      volume_error += std::abs(score.volume_error);
      ++scans;
    }
  EXPECT_GE(right, 0.8 * branches);
  EXPECT_LE(radius_error / scans, 0.35);
  EXPECT_LE(volume_error / scans, 0.3);
}

}  // namespace
}  // namespace bisector
