#include "support/tree_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/models.h"
#include "support/tree_score.h"

namespace bisector {
namespace {

using test::AxisBranch;
using test::make_tree;
using test::score_tree;
using test::SplitMix64;
using test::TreeModel;
using test::TreeScore;

const TreeModel& small_model() {
  static const TreeModel model = make_tree({.points = 8000});
  return model;
}

double length_of(const std::vector<Vec3>& axis, std::size_t from = 0) {
  double length = 0;
  for (std::size_t i = from + 1; i < axis.size(); ++i) length += norm(axis[i] - axis[i - 1]);
  return length;
}

// Point of the parent's axis that a branch begins at.
std::size_t fork_of(const std::vector<AxisBranch>& branches, std::size_t b) {
  const std::vector<Vec3>& on = branches[branches[b].parent].axis;
  return static_cast<std::size_t>(std::find(on.begin(), on.end(), branches[b].axis[0]) - on.begin());
}

int order_of(const std::vector<AxisBranch>& branches, std::size_t b) {
  int order = 0;
  for (Index p = branches[b].parent; p != kNone; p = branches[p].parent) ++order;
  return order;
}

// Distances from the nearest axis, less the radius there.
double off_surface(const std::vector<AxisBranch>& branches, const Vec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const AxisBranch& b : branches)
    for (std::size_t i = 1; i < b.axis.size(); ++i) {
      const Vec3 d = b.axis[i] - b.axis[i - 1];
      const double t = std::clamp(dot(p - b.axis[i - 1], d) / norm2(d), 0.0, 1.0);
      best = std::min(best, norm(b.axis[i - 1] + t * d - p) - ((1 - t) * b.radii[i - 1] + t * b.radii[i]));
    }
  return best;
}

TEST(TreeModel, IsATreeAsTheyGrow) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const TreeModel model = make_tree({.points = 100, .random_seed = seed});
    const std::vector<AxisBranch>& branches = model.branches;
    EXPECT_GE(branches.size(), 60u) << "seed " << seed;
    int orders = 0;
    EXPECT_EQ(branches[0].parent, kNone);
    for (std::size_t b = 0; b < branches.size(); ++b) {
      orders = std::max(orders, order_of(branches, b));
      ASSERT_EQ(branches[b].axis.size(), branches[b].radii.size());
      EXPECT_TRUE(std::is_sorted(branches[b].radii.rbegin(), branches[b].radii.rend()));
      EXPECT_GT(branches[b].radii.back(), 0);
      if (b == 0) continue;
      ASSERT_LT(branches[b].parent, b);
      const AxisBranch& parent = branches[branches[b].parent];
      const std::size_t fork = fork_of(branches, b);
      ASSERT_LT(fork, parent.axis.size());
      EXPECT_LT(branches[b].radii[0], parent.radii[fork]);
      EXPECT_LT(length_of(branches[b].axis), length_of(parent.axis, fork));
      EXPECT_GT(length_of(branches[b].axis), 3 * branches[b].radii[0]);
    }
    EXPECT_EQ(orders, 2);
  }
}

TEST(TreeModel, PointsAreOnTheSurfacesButForNoise) {
  const TreeModel clean = make_tree({.points = 4000, .noise = 0, .occlusion = 0});
  EXPECT_EQ(clean.points.size(), 4000u);
  for (const Vec3& p : clean.points) EXPECT_NEAR(off_surface(clean.branches, p), 0, 2e-3 * clean.height);
  const TreeModel noisy = make_tree({.points = 4000, .occlusion = 0});
  double squares = 0;
  for (const Vec3& p : noisy.points) squares += std::pow(off_surface(noisy.branches, p), 2);
  // Less than the deviation where branches meet, more where a thin branch's curvature adds to it.
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(noisy.points.size())), 0.002 * noisy.height,
              0.0004 * noisy.height);
}

TEST(TreeModel, OcclusionTakesItsShareInPatches) {
  const TreeModel model = make_tree({.points = 8000, .occlusion = 0.2});
  EXPECT_NEAR(static_cast<double>(model.points.size()), 8000, 200);
  // At some places of the surface all samples within 1 % of the height are missing: the whole has 10000 of them.
  const TreeModel whole = make_tree({.points = 10000, .noise = 0, .occlusion = 0});
  std::size_t bare = 0;
  for (std::size_t i = 0; i < whole.points.size(); i += 10) {
    std::size_t near = 0, all = 0;
    for (const Vec3& p : model.points) near += norm(p - whole.points[i]) < 0.01 * model.height;
    for (const Vec3& p : whole.points) all += norm(p - whole.points[i]) < 0.01 * model.height;
    bare += all >= 10 && near == 0;
  }
  EXPECT_GT(bare, 5u);
}

TEST(TreeModel, IsTheSameEachTime) {
  const TreeModel a = make_tree({.points = 500}), b = make_tree({.points = 500}),
                  c = make_tree({.points = 500, .random_seed = 2});
  EXPECT_TRUE(a.points == b.points);
  EXPECT_FALSE(a.points == c.points);
}

TEST(TreeScore, TruthIsPerfect) {
  const TreeModel& model = small_model();
  const TreeScore score = score_tree(model.branches, model.branches, model.noise);
  EXPECT_EQ(score.branches, model.branches.size());
  EXPECT_EQ(score.found, score.branches);
  EXPECT_EQ(score.right_parent, score.branches);
  EXPECT_EQ(score.spurious, 0u);
  EXPECT_EQ(score.covered, 1);
  EXPECT_LT(score.radius_error, 1e-9);
  EXPECT_LT(score.axis_median, 1e-9);
  EXPECT_LT(score.axis_mean, 1e-9);
  EXPECT_EQ(score.roots, 1u);
  EXPECT_FALSE(score.loops);
}

TEST(TreeScore, NothingFoundIsZero) {
  const TreeModel& model = small_model();
  const TreeScore score = score_tree(model.branches, {}, model.noise);
  EXPECT_EQ(score.branches, model.branches.size());
  EXPECT_EQ(score.found, 0u);
  EXPECT_EQ(score.covered, 0);
  EXPECT_EQ(score.roots, 0u);
}

TEST(TreeScore, MissingBranchesAreMissed) {
  const TreeModel& model = small_model();
  std::vector<AxisBranch> found = model.branches;
  for (int k = 0; k < 5; ++k) found.pop_back();  // twigs: nobody's parents
  const TreeScore score = score_tree(model.branches, found, model.noise);
  EXPECT_EQ(score.found, score.branches - 5);
  EXPECT_EQ(score.right_parent, score.branches - 5);
  EXPECT_LT(score.covered, 1);
}

TEST(TreeScore, ShortenedBranchesAreMissedBelowSeventyPercent) {
  const TreeModel& model = small_model();
  for (const auto& [share, is_found] : {std::pair{0.85, true}, std::pair{0.55, false}}) {
    std::vector<AxisBranch> found = model.branches;
    AxisBranch& last = found.back();
    const auto left = static_cast<std::size_t>(share * static_cast<double>(last.axis.size()));
    last.axis.resize(left);
    last.radii.resize(left);
    EXPECT_EQ(score_tree(model.branches, found, model.noise).found, found.size() - (is_found ? 0 : 1));
  }
}

TEST(TreeScore, WrongParentsCount) {
  const TreeModel& model = small_model();
  std::vector<AxisBranch> found = model.branches;
  found.back().parent = 0;  // a twig said to be on the trunk
  const TreeScore score = score_tree(model.branches, found, model.noise);
  EXPECT_EQ(score.found, score.branches);
  EXPECT_EQ(score.right_parent, score.branches - 1);
  found.back().parent = kNone;
  EXPECT_EQ(score_tree(model.branches, found, model.noise).right_parent, score.branches - 1);
  EXPECT_EQ(score_tree(model.branches, found, model.noise).roots, 2u);
}

TEST(TreeScore, AParentInTwoPiecesIsStillTheParent) {
  const TreeModel& model = small_model();
  std::vector<AxisBranch> found = model.branches;
  AxisBranch upper;
  AxisBranch& trunk = found[0];
  const std::size_t cut = 8 * trunk.axis.size() / 10;
  upper.axis.assign(trunk.axis.begin() + static_cast<std::ptrdiff_t>(cut), trunk.axis.end());
  upper.radii.assign(trunk.radii.begin() + static_cast<std::ptrdiff_t>(cut), trunk.radii.end());
  upper.parent = 0;
  std::size_t moved = 0;
  for (std::size_t b = 1; b < found.size(); ++b)
    if (found[b].parent == 0 && fork_of(model.branches, b) > cut)
      found[b].parent = static_cast<Index>(found.size()), ++moved;
  ASSERT_GT(moved, 0u);
  trunk.axis.resize(cut + 1);
  trunk.radii.resize(cut + 1);
  found.push_back(upper);
  const TreeScore score = score_tree(model.branches, found, model.noise);
  EXPECT_EQ(score.found, score.branches);
  EXPECT_EQ(score.right_parent, score.branches);
  EXPECT_EQ(score.spurious, 0u);
}

TEST(TreeScore, ErrorsAreMeasured) {
  const TreeModel& model = small_model();
  std::vector<AxisBranch> found = model.branches;
  for (AxisBranch& branch : found)
    for (double& r : branch.radii) r *= 1.2;
  EXPECT_NEAR(score_tree(model.branches, found, model.noise).radius_error, 0.2, 0.01);

  // The whole tree moved aside by a length: small against the trunk's radius, and more than half a twig's.
  const double step = 0.3 * model.branches[0].radii[0];
  found = model.branches;
  for (AxisBranch& branch : found)
    for (Vec3& p : branch.axis) p.x += step;
  const TreeScore moved = score_tree(model.branches, found, model.noise);
  EXPECT_LT(moved.found, moved.branches / 2);
  EXPECT_GT(moved.axis_median, 0.5);

  // By 0.7 of the radius at each point: inside the branches, but not accurate.
  found = model.branches;
  for (std::size_t b = 0; b < found.size(); ++b)
    for (std::size_t i = 0; i < found[b].axis.size(); ++i) found[b].axis[i].x += 0.7 * found[b].radii[i];
  EXPECT_GT(score_tree(model.branches, found, 0, 1).found, score_tree(model.branches, found, 0, 0.5).found);
  EXPECT_EQ(score_tree(model.branches, found, 0, 1).found, model.branches.size());
}

TEST(TreeScore, BranchesWhereThereAreNoneAreSpurious) {
  const TreeModel& model = small_model();
  std::vector<AxisBranch> found = model.branches;
  found.push_back({{model.branches[0].axis[100], model.branches[0].axis[100] + Vec3{-5, 5, -1}}, {0.01, 0.01}, 0});
  const TreeScore score = score_tree(model.branches, found, model.noise);
  EXPECT_EQ(score.spurious, 1u);
  EXPECT_EQ(score.found, score.branches);
}

TEST(TreeScore, LoopsAndParentsThatAreNotThereAreSeen) {
  const TreeModel& model = small_model();
  std::vector<AxisBranch> found = model.branches;
  found[0].parent = 1;
  EXPECT_TRUE(score_tree(model.branches, found, model.noise).loops);
  found[0].parent = static_cast<Index>(found.size());
  EXPECT_TRUE(score_tree(model.branches, found, model.noise).loops);
}

}  // namespace
}  // namespace bisector
