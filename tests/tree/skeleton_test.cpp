#include "tree/skeleton.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"
#include "tree/branches.h"
#include "tree/polyline.h"
#include "tree/tube_fit.h"

namespace bisector {
namespace {

BranchCylinder at(const Vec3& centre, double radius = 0.1, const Vec3& axis = {0, 0, 1}) {
  return {centre, axis, radius, radius, 1, 0};
}

// A chain of points, each its own neighbour's neighbour, two to a cluster.
struct Chain {
  std::vector<Vec3> points;
  Csr<Index> neighbours;
  std::vector<Index> label;
  std::vector<BranchCylinder> cylinders;
};

Chain make_chain(std::size_t clusters) {
  Chain chain;
  for (std::size_t i = 0; i < 2 * clusters; ++i) {
    chain.points.push_back({0, 0, static_cast<double>(i)});
    chain.label.push_back(static_cast<Index>(i / 2));
    if (i > 0) chain.neighbours.values.push_back(static_cast<Index>(i - 1));
    if (i + 1 < 2 * clusters) chain.neighbours.values.push_back(static_cast<Index>(i + 1));
    chain.neighbours.offsets.push_back(chain.neighbours.values.size());
  }
  for (std::size_t c = 0; c < clusters; ++c) chain.cylinders.push_back(at({0, 0, 2 * static_cast<double>(c) + 0.5}));
  return chain;
}

TEST(ClusterLinks, JunctionsAreBetweenBoundaryPoints) {
  const Chain chain = make_chain(4);
  const std::vector<ClusterLink> links = link_clusters(chain.points, chain.neighbours, chain.label, chain.cylinders);
  ASSERT_EQ(links.size(), 3u);
  for (std::size_t k = 0; k < links.size(); ++k) {
    EXPECT_EQ(links[k].from, k);
    EXPECT_EQ(links[k].to, k + 1);
    EXPECT_DOUBLE_EQ(links[k].junction.z, 2 * static_cast<double>(k) + 1.5);
    EXPECT_DOUBLE_EQ(links[k].length, 2);
  }
}

TEST(ClusterLinks, GapsAreMeasuredBetweenNearestPoints) {
  Chain chain = make_chain(4);
  // Cut between the second and the third cluster, which then are 5 apart.
  chain.neighbours = {};
  std::vector<Index> component;
  for (std::size_t i = 0; i < chain.points.size(); ++i) {
    if (i >= 4) chain.points[i].z += 4;
    component.push_back(i >= 4);
    if (i % 4 > 0) chain.neighbours.values.push_back(static_cast<Index>(i - 1));
    if (i % 4 < 3) chain.neighbours.values.push_back(static_cast<Index>(i + 1));
    chain.neighbours.offsets.push_back(chain.neighbours.values.size());
  }
  chain.cylinders[2].centre.z += 4;
  chain.cylinders[3].centre.z += 4;
  std::vector<ClusterLink> links = link_clusters(chain.points, chain.neighbours, chain.label, chain.cylinders);
  ASSERT_EQ(links.size(), 2u);
  link_across_gaps(chain.points, chain.label, component, chain.cylinders, links);
  ASSERT_EQ(links.size(), 2u + 4);
  for (const ClusterLink& link : links)
    if (link.to - link.from == 1) {
      EXPECT_DOUBLE_EQ(link.gap, link.from == 1 ? 5 : 0);
    }
}

// A branch goes on along its axis, though another cluster is nearer.
TEST(ClusterLinks, WeighTurnsAndGaps) {
  const std::vector<BranchCylinder> cylinders{at({0, 0, 0}), at({0, 0, 1}), at({1, 0, 0})};
  std::vector<ClusterLink> links{{0, 1, {0, 0, 0.5}, 0, 1}, {0, 2, {0.5, 0, 0}, 0, 1}};
  weigh_links(cylinders, links);
  EXPECT_DOUBLE_EQ(links[0].length, 1);
  EXPECT_GT(links[1].length, 2);
  std::vector<ClusterLink> gap{{0, 1, {0, 0, 0.5}, 0.5, 1}};
  weigh_links(cylinders, gap);
  EXPECT_GT(gap[0].length, 2);
}

// Three clusters that meet are a loop of links, of which paths leave one out (thesis Figure 3.3).
TEST(Skeleton, HasNoLoop) {
  const std::vector<BranchCylinder> cylinders{at({0, 0, 0}), at({0, 0, 1}), at({1, 0, 1}),
                                              at({0, 0, 2}), at({2, 0, 2}), at({9, 9, 9})};
  const std::vector<ClusterLink> links{{0, 1, {0, 0, 0.5}, 0, 1},
                                       {0, 2, {0.5, 0, 0.5}, 0, 1.5},
                                       {1, 2, {0.5, 0, 1}, 0, 1},
                                       {1, 3, {0, 0, 1.5}, 0, 1},
                                       {2, 4, {1.5, 0, 1.5}, 0, 1.5}};
  const std::vector<SkeletonNode> nodes = make_skeleton(links, cylinders, {0});
  std::size_t roots = 0, centres = 0;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (nodes[k].parent == kNone) ++roots;
    else EXPECT_LT(nodes[k].parent, k);
    if (nodes[k].cluster != kNone) ++centres;
    EXPECT_NE(nodes[k].cluster, 5u);  // nothing leads there
  }
  EXPECT_EQ(roots, 1u);
  EXPECT_EQ(centres, 5u);
  // 5 centres, 4 junctions, one beyond the root and each of the two leaves.
  EXPECT_EQ(nodes.size(), 5u + 4 + 1 + 2);
  EXPECT_DOUBLE_EQ(nodes[0].position.z, -0.5);
  bool tip = false;
  for (const SkeletonNode& node : nodes) tip = tip || (node.cluster == kNone && node.position == Vec3{0, 0, 2.5});
  EXPECT_TRUE(tip);
}

TEST(Skeleton, OfOneClusterIsItsAxis) {
  const std::vector<SkeletonNode> nodes = make_skeleton({}, {at({0, 0, 3}, 0.2)}, {0});
  ASSERT_EQ(nodes.size(), 3u);
  EXPECT_LT(nodes[0].position.z, nodes[1].position.z);
  EXPECT_LT(nodes[1].position.z, nodes[2].position.z);
}

// A trunk of 10, a bough of 6 at 4 and a twig of 2 on the bough.
std::vector<SkeletonNode> known_tree() {
  std::vector<SkeletonNode> nodes;
  for (int k = 0; k <= 10; ++k)
    nodes.push_back({{0, 0, static_cast<double>(k)}, 0.1, k ? static_cast<Index>(k - 1) : kNone, kNone});
  for (int k = 1; k <= 6; ++k)
    nodes.push_back({{static_cast<double>(k), 0, 4}, 0.05, k == 1 ? 4 : static_cast<Index>(nodes.size() - 1), kNone});
  for (int k = 1; k <= 2; ++k)
    nodes.push_back({{3, static_cast<double>(k), 4}, 0.02, k == 1 ? 13 : static_cast<Index>(nodes.size() - 1), kNone});
  return nodes;
}

TEST(Branches, AreTheLongestPaths) {
  const std::vector<SkeletonBranch> branches = find_branches(known_tree());
  ASSERT_EQ(branches.size(), 3u);
  EXPECT_EQ(branches[0].nodes.size(), 11u);
  EXPECT_EQ(branches[0].parent, kNone);
  EXPECT_EQ(branches[1].nodes.size(), 7u);
  EXPECT_EQ(branches[1].nodes[0], 4u);
  EXPECT_EQ(branches[1].parent, 0u);
  EXPECT_EQ(branches[2].nodes.size(), 3u);
  EXPECT_EQ(branches[2].parent, 1u);
}

TEST(Branches, HoldEveryNodeOnce) {
  Random random(5);
  std::vector<SkeletonNode> nodes{{{0, 0, 0}, 1, kNone, kNone}};
  for (Index k = 1; k < 300; ++k) {
    const auto parent = static_cast<Index>(random.uniform() * k);
    nodes.push_back(
        {nodes[parent].position + Vec3{random.uniform(), random.uniform(), random.uniform()}, 0.1, parent, kNone});
  }
  const std::vector<SkeletonBranch> branches = find_branches(nodes);
  std::vector<int> count(nodes.size(), 0);
  for (std::size_t b = 0; b < branches.size(); ++b) {
    const bool trunk = branches[b].parent == kNone;
    EXPECT_TRUE(trunk || branches[b].parent < b);
    for (std::size_t k = 0; k < branches[b].nodes.size(); ++k) {
      EXPECT_TRUE(k == 0 || nodes[branches[b].nodes[k]].parent == branches[b].nodes[k - 1]);
      if (k > 0 || trunk) ++count[branches[b].nodes[k]];
    }
  }
  for (const int c : count) EXPECT_EQ(c, 1);
}

// Of two paths of nearly the same length the straight and thick one goes on.
TEST(Branches, GoStraightOnWherePathsAreSimilar) {
  std::vector<SkeletonNode> nodes;
  for (int k = 0; k <= 5; ++k)
    nodes.push_back({{0, 0, static_cast<double>(k)}, 0.5, k ? static_cast<Index>(k - 1) : kNone, kNone});
  for (int k = 1; k <= 5; ++k)
    nodes.push_back(
        {{0, 0, 5 + static_cast<double>(k)}, 0.5, k == 1 ? 5 : static_cast<Index>(nodes.size() - 1), kNone});
  const auto straight_tip = static_cast<Index>(nodes.size() - 1);
  for (int k = 1; k <= 5; ++k)
    nodes.push_back({{1.05 * k, 0, 5}, 0.2, k == 1 ? 5 : static_cast<Index>(nodes.size() - 1), kNone});
  EXPECT_EQ(find_branches(nodes)[0].nodes.back(), straight_tip);
}

double gaussian(Random& random) {
  const double u = random.uniform(), v = random.uniform();
  return std::sqrt(-2 * std::log(1 - u)) * std::cos(2 * std::numbers::pi * v);
}

// On a tapering tube around an arc of a circle of radius 2, over a share of the circumference.
std::vector<Vec3> tube_points(std::size_t count, double noise, double share) {
  Random random(9);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = random.uniform(), angle = 2 * std::numbers::pi * share * random.uniform(), radius = 0.1 - 0.05 * t;
    const double out = 2 + radius * std::cos(angle);
    Vec3 p{out * std::cos(t), radius * std::sin(angle), out * std::sin(t)};
    for (int k = 0; k < 3; ++k) p[k] += noise * gaussian(random);
    points.push_back(p);
  }
  return points;
}

TEST(TubeFit, FindsAxisAndRadius) {
  for (const double share : {1.0, 0.5})
    for (const double noise : {0.0, 0.01}) {
      std::vector<Vec3> rough;  // off the axis, as centres of points on one side are
      for (int k = 0; k <= 10; ++k)
        rough.push_back({(2 + 0.04) * std::cos(0.1 * k), 0.03 * (k % 2), (2 + 0.04) * std::sin(0.1 * k)});
      const Tube tube = fit_tube(tube_points(4000, noise, share), rough, noise);
      for (std::size_t k = 1; k + 1 < tube.axis.size(); ++k) {
        const Vec3& p = tube.axis[k];
        const double off = std::hypot(std::hypot(p.x, p.z) - 2, p.y), t = std::atan2(p.z, p.x);
        if (t < 0.1 || t > 0.9) continue;  // points end within a radius or two of here
        EXPECT_LT(off, 0.02) << share << " " << noise << " at " << t;
        EXPECT_NEAR(tube.radii[k], 0.1 - 0.05 * t, 0.012);
      }
      EXPECT_NEAR(std::atan2(tube.axis.back().z, tube.axis.back().x), 1, 0.06);
    }
}

TEST(TubeFit, PointsOfAnotherBranchDoNotBendIt) {
  std::vector<Vec3> points = tube_points(3000, 0, 1);
  for (int i = 0; i < 300; ++i)
    points.push_back({2 * std::cos(0.5) + 0.1 + 0.002 * i, 0.02 * std::sin(i), 2 * std::sin(0.5)});
  const Tube tube = fit_tube(
      points, {{2, 0, 0}, {2 * std::cos(0.5), 0, 2 * std::sin(0.5)}, {2 * std::cos(1.0), 0, 2 * std::sin(1.0)}}, 0.002);
  for (std::size_t k = 2; k + 2 < tube.axis.size(); ++k)
    EXPECT_LT(std::hypot(std::hypot(tube.axis[k].x, tube.axis[k].z) - 2, tube.axis[k].y), 0.02);
}

TEST(TubeFit, FewPointsLeaveTheLine) {
  const std::vector<Vec3> line{{0, 0, 0}, {0, 0, 1}};
  for (const std::vector<Vec3>& points :
       {std::vector<Vec3>{}, std::vector<Vec3>{{0.1, 0, 0.5}}, std::vector<Vec3>(3, Vec3{0, 0.2, 0.5})}) {
    const Tube tube = fit_tube(points, line, 0.01);
    EXPECT_EQ(tube.axis.front(), line.front());
    EXPECT_EQ(tube.axis.back(), line.back());
    for (const double r : tube.radii) EXPECT_GT(r, 0);
  }
  for (const double r : fit_tube(std::vector<Vec3>(40, Vec3{0, 0.2, 0.5}), line, 0).radii)
    EXPECT_TRUE(std::isfinite(r));
}

TEST(NonIncreasing, IsTheNearestInLeastSquares) {
  Random random(6);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<double> values, weights;
    for (int i = 0; i < 7; ++i) {
      values.push_back(random.uniform());
      weights.push_back(0.1 + random.uniform());
    }
    const std::vector<double> fitted = non_increasing(values, weights);
    ASSERT_EQ(fitted.size(), values.size());
    const auto cost = [&](const std::vector<double>& x) {
      double sum = 0;
      for (std::size_t i = 0; i < x.size(); ++i) sum += weights[i] * (x[i] - values[i]) * (x[i] - values[i]);
      return sum;
    };
    for (std::size_t i = 0; i + 1 < fitted.size(); ++i) EXPECT_GE(fitted[i], fitted[i + 1]);
    // No other non-increasing sequence near it is better.
    for (int k = 0; k < 200; ++k) {
      std::vector<double> other = fitted;
      for (double& x : other) x += 0.05 * (random.uniform() - 0.5);
      std::sort(other.rbegin(), other.rend());
      EXPECT_GE(cost(other), cost(fitted) - 1e-12);
    }
  }
}

TEST(Polyline, ResamplingKeepsEndsAndIsEven) {
  const std::vector<Vec3> line{{0, 0, 0}, {1, 0, 0}, {1, 3, 0}, {1, 3, 0}, {1, 3, 2}};
  EXPECT_DOUBLE_EQ(polyline_length(line), 6);
  const std::vector<Vec3> even = resample_polyline(line, 7);
  ASSERT_EQ(even.size(), 7u);
  EXPECT_EQ(even.front(), line.front());
  EXPECT_EQ(even.back(), line.back());
  for (std::size_t k = 1; k < even.size(); ++k) EXPECT_NEAR(norm(even[k] - even[k - 1]), 1, 1e-12);
}

}  // namespace
}  // namespace bisector
