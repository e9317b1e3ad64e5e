#include "support/tree_scan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bisector/tree.h"
#include "core/parallel.h"
#include "support/tree_score.h"

namespace bisector {
namespace {

using test::AxisBranch;
using test::LeafDisc;
using test::PointKind;
using test::ScanPath;
using test::SplitMix64;
using test::TreeScan;

constexpr ScanPath kPaths[]{ScanPath::one_side, ScanPath::street, ScanPath::airborne};

// Distance from the branches' surfaces, negative inside.
double off_branches(const std::vector<AxisBranch>& branches, const Vec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const AxisBranch& b : branches)
    for (std::size_t i = 1; i < b.axis.size(); ++i) {
      const Vec3 d = b.axis[i] - b.axis[i - 1];
      const double t = std::clamp(dot(p - b.axis[i - 1], d) / norm2(d), 0.0, 1.0);
      best = std::min(best, norm(b.axis[i - 1] + t * d - p) - ((1 - t) * b.radii[i - 1] + t * b.radii[i]));
    }
  return best;
}

double off_leaf(const LeafDisc& leaf, const Vec3& p) {
  const double above = dot(p - leaf.centre, leaf.normal);
  const double aside = norm(p - leaf.centre - above * leaf.normal);
  return std::hypot(above, std::max(0.0, aside - leaf.radius));
}

double off_leaves(const std::vector<LeafDisc>& leaves, const Vec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const LeafDisc& leaf : leaves) best = std::min(best, off_leaf(leaf, p));
  return best;
}

// How deep inside branches a ray is, at most, before `range`, by steps no longer than the distance from the nearest.
double deepest(const std::vector<AxisBranch>& branches, const Vec3& origin, const Vec3& direction, double range) {
  double deep = 0;
  for (double t = 0; t < range;) {
    const double distance = off_branches(branches, origin + t * direction);
    deep = std::max(deep, -distance);
    t += std::max(0.9 * distance, 1e-3);
  }
  return deep;
}

// Whether a ray crosses a leaf before `range`: the corners of its way lie on both sides of the leaf's plane.
bool crosses(const LeafDisc& leaf, const Vec3& from, const Vec3& to) {
  const double a = dot(from - leaf.centre, leaf.normal), b = dot(to - leaf.centre, leaf.normal);
  if (a * b >= 0) return false;
  return norm((1 / (a - b)) * (a * to - b * from) - leaf.centre) < leaf.radius * (1 - 1e-9);
}

std::vector<AxisBranch> small_tree() {
  test::TreeGrowth growth = test::varied_growth(3);
  growth.boughs = 5;
  growth.twigs = 2;
  growth.shoots = 0;
  SplitMix64 random(3);
  return test::grow_tree(growth, random);
}

TEST(TreeGrowth, SeedsGiveTreesOfManyKinds) {
  double lowest = 100, highest = 0, thinnest = 1, least_pipe = 3, most_pipe = 2;
  std::size_t forks = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const test::TreeGrowth growth = test::varied_growth(seed);
    SplitMix64 random(seed);
    const std::vector<AxisBranch> branches = test::grow_tree(growth, random);
    lowest = std::min(lowest, test::tree_height(branches));
    highest = std::max(highest, test::tree_height(branches));
    least_pipe = std::min(least_pipe, growth.pipe);
    most_pipe = std::max(most_pipe, growth.pipe);
    forks += growth.fork > 0;
    EXPECT_GE(branches.size(), 20u) << "seed " << seed;
    EXPECT_GE(branches[0].radii[0], 0.1);
    EXPECT_LE(branches[0].radii[0], 0.25);
    for (std::size_t b = 0; b < branches.size(); ++b) {
      EXPECT_TRUE(std::is_sorted(branches[b].radii.rbegin(), branches[b].radii.rend()));
      thinnest = std::min(thinnest, branches[b].radii.back());
      if (b == 0) continue;
      ASSERT_LT(branches[b].parent, b);
      const AxisBranch& parent = branches[branches[b].parent];
      const auto fork = std::find(parent.axis.begin(), parent.axis.end(), branches[b].axis[0]) - parent.axis.begin();
      ASSERT_LT(fork, std::ssize(parent.axis));
      EXPECT_LT(branches[b].radii[0], parent.radii[static_cast<std::size_t>(fork)]);
    }
  }
  EXPECT_LT(lowest, 7);
  EXPECT_GT(highest, 11);
  EXPECT_LT(thinnest, 0.006);
  EXPECT_LT(least_pipe, 2.3);
  EXPECT_GT(most_pipe, 2.7);
  EXPECT_GT(forks, 0u);
  EXPECT_LT(forks, 12u);
}

TEST(TreeScene, RaysEndAtTheFirstSurface) {
  const std::vector<AxisBranch> branches = small_tree();
  const test::TreeScene scene(branches, {});
  const Box box = scene.box();
  SplitMix64 random(1);
  std::size_t hits = 0;
  for (int k = 0; k < 400; ++k) {
    Vec3 from, to;
    for (int c = 0; c < 3; ++c) to[c] = random.range(box.lo[c], box.hi[c]);
    if (k % 2 == 0) {  // towards an axis
      const std::vector<Vec3>& axis = branches[random.below(branches.size())].axis;
      to = axis[random.below(axis.size())];
    }
    from = to + 15 * unit({random.range(-1, 1), random.range(-1, 1), random.range(-0.2, 1)});
    const Vec3 direction = unit(to - from);
    const test::SceneHit hit = scene.first_hit(from, direction);
    EXPECT_LT(deepest(branches, from, direction, std::min(hit.range, 30.0)), 1e-6);
    if (!std::isfinite(hit.range)) {
      EXPECT_EQ(hit.branch, kNone);
      EXPECT_EQ(k % 2, 1);  // what goes to an axis meets a surface
      continue;
    }
    ++hits;
    EXPECT_NEAR(off_branches(branches, from + hit.range * direction), 0, 1e-6);
    EXPECT_NEAR(off_branches({branches[hit.branch]}, from + hit.range * direction), 0, 1e-6);
  }
  EXPECT_GE(hits, 200u);
}

TEST(TreeScene, APoleHasAConesWallAndRoundEnds) {
  const test::TreeScene scene({{{{0, 0, 0}, {0, 0, 4}}, {0.2, 0.1}}}, {});
  EXPECT_NEAR(scene.first_hit({0, 0, -5}, {0, 0, 1}).range, 4.8, 1e-12);
  EXPECT_NEAR(scene.first_hit({0, 0, 9}, {0, 0, -1}).range, 4.9, 1e-12);
  EXPECT_NEAR(scene.first_hit({-5, 0, 2}, {1, 0, 0}).range, 4.85, 1e-12);
  EXPECT_NEAR(scene.first_hit({-5, 0, -0.16}, {1, 0, 0}).range, 4.88, 1e-12);
  EXPECT_EQ(scene.first_hit({-5, 0, 4.11}, {1, 0, 0}).branch, kNone);
  EXPECT_EQ(scene.first_hit({5, 0, 2}, {1, 0, 0}).branch, kNone);
}

TEST(TreeScene, LeavesAreMetOnTheirDiscs) {
  const LeafDisc near{{1, 0, 0}, {1, 0, 0}, 0.1}, far{{2, 0, 0}, unit({1, 1, 0}), 0.2};
  const test::TreeScene scene({}, {far, near});
  EXPECT_EQ(scene.first_hit({0, 0, 0}, {1, 0, 0}).leaf, 1u);
  EXPECT_NEAR(scene.first_hit({0, 0, 0}, {1, 0, 0}).range, 1, 1e-12);
  EXPECT_EQ(scene.first_hit({0, 0, 0.15}, {1, 0, 0}).leaf, 0u);
  EXPECT_EQ(scene.first_hit({0, 0, 0.25}, {1, 0, 0}).leaf, kNone);
  EXPECT_EQ(scene.first_hit({0, 0, 0}, {-1, 0, 0}).leaf, kNone);
  EXPECT_EQ(scene.first_leaf({0, 0, 0}, {1, 0, 0}, 3), 0u);
  EXPECT_EQ(scene.first_leaf({0, 0, 0}, {1, 0, 0}, 1.5), 1u);
  EXPECT_EQ(scene.first_leaf({0, 0, 0}, {1, 0, 0}, 0.5), kNone);
}

TEST(TreeScan, PointsAreOnWhatTheySayAndNothingIsInFront) {
  for (const ScanPath path : kPaths) {
    const TreeScan scan = test::scan_tree({.path = path,
                                           .points = 3000,
                                           .noise = 0,
                                           .beam = 0,
                                           .divergence = 0,
                                           .mixed = 0,
                                           .leaves = 0.3,
                                           .random_seed = 2});
    for (std::size_t i = 0; i < scan.points.size(); i += 15) {
      const Vec3 p = scan.points[i], way = p - scan.origins[i];
      if (scan.kinds[i] == PointKind::leaf) {
        EXPECT_EQ(scan.point_branches[i], kNone);
        EXPECT_LT(off_leaves(scan.leaves, p), 1e-6);
      } else {
        ASSERT_LT(scan.point_branches[i], scan.branches.size());
        EXPECT_NEAR(off_branches({scan.branches[scan.point_branches[i]]}, p), 0, 1e-6);
      }
      EXPECT_LT(deepest(scan.branches, scan.origins[i], unit(way), norm(way)), 1e-6);
      const Vec3 before = scan.origins[i] + (1 - 1e-9) * way;
      EXPECT_TRUE(std::none_of(scan.leaves.begin(), scan.leaves.end(),
                               [&](const LeafDisc& leaf) { return crosses(leaf, scan.origins[i], before); }));
    }
  }
}

TEST(TreeScan, PointsAreWithinBeamAndNoiseOfASurface) {
  for (const ScanPath path : kPaths) {
    const TreeScan scan =
        test::scan_tree({.path = path, .points = 3000, .noise = 0, .mixed = 0, .leaves = 0.2, .random_seed = 4});
    EXPECT_GT(scan.beam, 0.003);
    EXPECT_LT(scan.beam, 0.02);
    double most = 0;
    for (std::size_t i = 0; i < scan.points.size(); i += 5) {
      const double off =
          std::min(std::abs(off_branches(scan.branches, scan.points[i])), off_leaves(scan.leaves, scan.points[i]));
      most = std::max(most, off);
      EXPECT_LE(off, scan.beam * 1.01);
    }
    EXPECT_GT(most, 0.3 * scan.beam);  // thin twigs return what lies beside them
    const TreeScan noisy = test::scan_tree({.path = path, .points = 3000, .mixed = 0, .random_seed = 4});
    for (std::size_t i = 0; i < noisy.points.size(); i += 5)
      EXPECT_LE(std::abs(off_branches(noisy.branches, noisy.points[i])), noisy.beam * 1.01 + 6 * noisy.noise);
  }
}

TEST(TreeScan, NoiseIsAlongTheRay) {
  const TreeScan scan =
      test::scan_tree({.points = 4000, .noise = 0.01, .beam = 0, .divergence = 0, .mixed = 0, .random_seed = 1});
  const test::TreeScene scene(scan.branches, {});
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Vec3 way = scan.points[i] - scan.origins[i];
    const test::SceneHit hit = scene.first_hit(scan.origins[i], unit(way));
    ASSERT_EQ(hit.branch, scan.point_branches[i]);
    squares += std::pow(norm(way) - hit.range, 2);
    ++count;
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), 0.01, 0.0005);
}

TEST(TreeScan, MixedReturnsLieBetweenSurfaces) {
  const auto far_off = [](double mixed) {
    const TreeScan scan = test::scan_tree({.points = 8000, .noise = 0, .mixed = mixed, .random_seed = 2});
    std::size_t off = 0;
    for (std::size_t i = 0; i < scan.points.size(); ++i)
      off += std::abs(off_branches({scan.branches[scan.point_branches[i]]}, scan.points[i])) > 2 * scan.beam;
    return static_cast<double>(off) / static_cast<double>(scan.points.size());
  };
  EXPECT_EQ(far_off(0), 0);
  EXPECT_GT(far_off(1), 0);
  EXPECT_LT(far_off(1), 0.1);
}

TEST(TreeScan, OnePlaceSeesOneSide) {
  const TreeScan scan = test::scan_tree({.points = 5000, .noise = 0, .mixed = 0, .random_seed = 1});
  std::size_t behind = 0, of_trunk = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    EXPECT_TRUE(scan.origins[i] == scan.origins[0]);
    if (scan.point_branches[i] != 0) continue;
    const test::NearOnAxis near = test::nearest_on_axis(scan.branches[0], scan.points[i]);
    const auto at = static_cast<std::size_t>(near.place);
    ++of_trunk;
    behind += dot(scan.points[i] - scan.branches[0].axis[at], scan.origins[i] - scan.points[i]) < -0.1 * near.radius;
  }
  EXPECT_GT(of_trunk, 100u);
  EXPECT_LT(behind, of_trunk / 50);
}

TEST(TreeScan, CountsAndLeavesAreAsAskedFor) {
  for (const ScanPath path : kPaths)
    for (const auto& [points, leaves] : {std::pair<std::size_t, double>{5000, 0}, {20'000, 0.3}, {10'000, 0.6}}) {
      const TreeScan scan = test::scan_tree({.path = path, .points = points, .leaves = leaves, .random_seed = 5});
      const auto count = static_cast<double>(scan.points.size());
      EXPECT_GT(count, 0.9 * static_cast<double>(points));
      EXPECT_LT(count, 1.1 * static_cast<double>(points));
      EXPECT_NEAR(static_cast<double>(std::count(scan.kinds.begin(), scan.kinds.end(), PointKind::leaf)) / count,
                  leaves, 0.05);
    }
}

TEST(TreeScan, GroundAndNeighbourComeOnTop) {
  const TreeScan scan = test::scan_tree({.points = 5000, .ground = true, .neighbour = true, .random_seed = 6});
  ASSERT_LT(scan.tree_branches, scan.branches.size());
  EXPECT_EQ(scan.branches[scan.tree_branches].parent, kNone);
  const Vec3 base = scan.branches[0].axis[0];
  std::size_t ground = 0, tree = 0, other = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (scan.kinds[i] == PointKind::ground) {
      ++ground;
      EXPECT_NEAR(scan.points[i].z, base.z, 6 * scan.noise + scan.beam + 0.4);
      EXPECT_LT(norm(scan.points[i] - base), 4);
    } else {
      (scan.point_branches[i] < scan.tree_branches ? tree : other) += 1;
    }
  }
  EXPECT_GT(ground, 100u);
  EXPECT_GT(other, 100u);
  EXPECT_GT(tree, 4500u);
  EXPECT_LT(tree, 5500u);
}

TEST(TreeScan, IsTheSameEachTimeAndForAnyNumberOfThreads) {
  const auto scan = [](std::uint64_t seed) {
    return test::scan_tree({.points = 2000, .leaves = 0.2, .random_seed = seed});
  };
  const TreeScan a = scan(1), c = scan(2);
  const ThreadLimit limit(1);
  const TreeScan b = scan(1);
  EXPECT_TRUE(a.points == b.points);
  EXPECT_TRUE(a.kinds == b.kinds);
  EXPECT_TRUE(a.point_branches == b.point_branches);
  EXPECT_FALSE(a.points == c.points);
}

TEST(ScanScore, TruthIsPerfect) {
  for (const ScanPath path : kPaths) {
    const TreeScan scan = test::scan_tree({.path = path, .points = 5000, .leaves = 0.2, .random_seed = 1});
    const test::ScanScore score = test::score_scan(scan, scan.branches);
    EXPECT_GT(score.branches, 20u);
    EXPECT_EQ(score.found, score.branches);
    EXPECT_EQ(score.right_parent, score.branches);
    EXPECT_EQ(score.spurious, 0u);
    EXPECT_EQ(score.covered, 1);
    EXPECT_LT(score.radius_error, 1e-9);
    EXPECT_LT(score.thick_radius_error, 1e-9);
    EXPECT_NEAR(score.volume_error, 0, 1e-9);
  }
}

TEST(ScanScore, WhatHasNoPointsDoesNotCount) {
  TreeScan scan = test::scan_tree({.points = 5000, .random_seed = 1});
  const std::size_t all = test::score_scan(scan, scan.branches).branches;
  // Without a bough's points its twigs are expected on the trunk.
  const auto of = [&](Index b) { return std::count(scan.point_branches.begin(), scan.point_branches.end(), b); };
  Index bough = kNone;
  for (std::size_t b = 0; b < scan.branches.size(); ++b)
    if (scan.branches[b].parent == 0 && of(static_cast<Index>(b)) > 50) bough = static_cast<Index>(b);
  ASSERT_NE(bough, kNone);
  std::vector<AxisBranch> found = scan.branches;
  for (AxisBranch& branch : found)
    if (branch.parent == bough) branch.parent = 0;
  const std::size_t before = test::score_scan(scan, found).right_parent;
  EXPECT_LT(before, all);
  for (Index& b : scan.point_branches)
    if (b == bough) b = kNone;
  const test::ScanScore score = test::score_scan(scan, found);
  EXPECT_EQ(score.branches, all - 1);
  EXPECT_EQ(score.right_parent, score.branches);
}

TEST(ScanScore, ErrorsAreMeasured) {
  const TreeScan scan = test::scan_tree({.points = 5000, .random_seed = 1});
  std::vector<AxisBranch> found = scan.branches;
  for (AxisBranch& branch : found)
    for (double& r : branch.radii) r *= 1.2;
  const test::ScanScore thick = test::score_scan(scan, found);
  EXPECT_NEAR(thick.radius_error, 0.2, 0.01);
  EXPECT_NEAR(thick.volume_error, 0.44, 0.05);  // less what is inside thicker parents
  found = scan.branches;
  for (AxisBranch& branch : found)
    for (Vec3& p : branch.axis) p.x += 0.5;
  EXPECT_LT(test::score_scan(scan, found).found, scan.branches.size() / 10);
}

TEST(ScanScore, LeavesAsTheyAreCalled) {
  const TreeScan scan = test::scan_tree({.points = 3000, .leaves = 0.3, .random_seed = 1});
  std::vector<char> truth(scan.points.size());
  for (std::size_t i = 0; i < truth.size(); ++i) truth[i] = scan.kinds[i] == PointKind::leaf;
  EXPECT_EQ(test::score_leaves(scan, truth).precision, 1);
  EXPECT_EQ(test::score_leaves(scan, truth).recall, 1);
  const test::LeafScore all = test::score_leaves(scan, std::vector<char>(truth.size(), 1));
  EXPECT_NEAR(all.precision, 0.3, 0.05);
  EXPECT_EQ(all.recall, 1);
  const test::LeafScore none = test::score_leaves(scan, std::vector<char>(truth.size(), 0));
  EXPECT_EQ(none.precision, 1);
  EXPECT_EQ(none.recall, 0);
}

TEST(ScanScore, SurfacesOfAPole) {
  EXPECT_NEAR(test::wood_volume({{{{0, 0, 0}, {0, 0, 4}}, {0.2, 0.2}}}), std::numbers::pi * 0.04 * 4, 1e-9);
  std::vector<Vec3> points;
  SplitMix64 random(1);
  for (int k = 0; k < 4000; ++k) {
    const double angle = random.range(0, 2 * std::numbers::pi);
    points.push_back({0.2 * std::cos(angle), 0.2 * std::sin(angle), random.range(0, 5)});
  }
  const TreeResult tree = reconstruct_tree(points);
  const test::SurfaceScore score = test::score_surfaces(points, tree);
  EXPECT_GT(score.near_points, 0.99);
  EXPECT_LT(score.bare_area, 0.05);
  EXPECT_NEAR(score.allometric, 2, 0.2);  // a cylinder
  EXPECT_EQ(score.thicker, 0u);
  for (Vec3& p : points) p.x += 1;
  const test::SurfaceScore aside = test::score_surfaces(points, tree);
  EXPECT_EQ(aside.near_points, 0);
  EXPECT_EQ(aside.bare_area, 1);
}

}  // namespace
}  // namespace bisector
