#include "tree/clusters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "core/random.h"
#include "tree/cylinder.h"
#include "tree/level_sections.h"
#include "tree/point_graph.h"
#include "tree/shortest_paths.h"

namespace bisector {
namespace {

double gaussian(Random& random) {
  const double u = random.uniform(), v = random.uniform();
  return std::sqrt(-2 * std::log(1 - u)) * std::cos(2 * std::numbers::pi * v);
}

// Points on a cylinder about `axis` through `base`, over a share of its circumference.
std::vector<Vec3> cylinder_points(const Vec3& base, const Vec3& axis, double radius, double length, std::size_t count,
                                  double noise = 0, double share = 1, std::uint64_t seed = 1) {
  Random random(seed);
  const Vec3 z = (1 / norm(axis)) * axis;
  Vec3 x = cross(z, std::abs(z.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
  x *= 1 / norm(x);
  const Vec3 y = cross(z, x);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * share * random.uniform(), along = length * random.uniform();
    Vec3 p = base + along * z + radius * std::cos(angle) * x + radius * std::sin(angle) * y;
    for (int k = 0; k < 3; ++k) p[k] += noise * gaussian(random);
    points.push_back(p);
  }
  return points;
}

TEST(BranchCylinder, IsFoundFromPartOfIt) {
  const Vec3 axis{0.6, 0, 0.8}, base{1e5, -3e5, 20};
  for (const double share : {1.0, 0.6, 0.4}) {
    const BranchCylinder c = fit_cylinder(cylinder_points(base, axis, 0.5, 4, 2000, 0, share), axis);
    EXPECT_NEAR(c.radius, 0.5, 1e-3) << share;
    EXPECT_NEAR(c.length, 4, 0.02);
    EXPECT_LT(c.rms, 1e-3);
    EXPECT_LT(norm(cross(c.centre - base, c.axis)), 2e-3);
    EXPECT_GE(c.bounding_radius, (share < 0.5 ? 0.95 * std::sin(std::numbers::pi * share) : 0.99) * 0.5);
  }
}

TEST(BranchCylinder, AxisIsThePrincipalDirectionUnlessGiven) {
  const Vec3 axis{0, 0.6, 0.8};
  const BranchCylinder c = fit_cylinder(cylinder_points({}, axis, 0.2, 5, 3000));
  EXPECT_GT(std::abs(dot(c.axis, axis)), 0.9999);
}

// Noise makes the bounding circle too large, the circle of least squares hardly.
TEST(BranchCylinder, NoiseDoesNotMakeItThicker) {
  const double noise = 0.05;
  const BranchCylinder c = fit_cylinder(cylinder_points({}, {0, 0, 1}, 0.5, 3, 4000, noise), {0, 0, 1});
  EXPECT_NEAR(c.radius, 0.5, 0.01);
  EXPECT_NEAR(c.rms, noise, 0.1 * noise);
  EXPECT_GT(c.bounding_radius, 0.5 + 2 * noise);
}

TEST(BranchCylinder, DegeneratePointsHaveFiniteOnes) {
  const std::vector<std::vector<Vec3>> clouds{{{1, 2, 3}},
                                              std::vector<Vec3>(9, Vec3{1, 2, 3}),
                                              {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}},
                                              {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {3, 2, 0}}};
  for (const auto& cloud : clouds)
    for (const Vec3& axis : {Vec3{}, Vec3{0, 0, 1}, Vec3{1, 1, 1}}) {
      const BranchCylinder c = fit_cylinder(cloud, axis);
      EXPECT_TRUE(std::isfinite(c.radius) && std::isfinite(c.rms) && std::isfinite(norm(c.centre)));
      EXPECT_LE(c.radius, 2 * c.bounding_radius + 1e-12);
      EXPECT_NEAR(norm(c.axis), 1, 1e-12);
    }
}

TEST(ShortestPaths, AreThoseOfAllPairs) {
  Random random(3);
  const std::size_t n = 40;
  std::vector<std::vector<double>> between(n, std::vector<double>(n, 1e300));
  for (std::size_t i = 0; i < n; ++i) between[i][i] = 0;
  for (int e = 0; e < 70; ++e) {
    const auto a = static_cast<std::size_t>(random.uniform() * n), b = static_cast<std::size_t>(random.uniform() * n);
    if (a != b) between[a][b] = between[b][a] = 0.1 + random.uniform();
  }
  Csr<Index> neighbours;
  std::vector<double> lengths;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j)
      if (i != j && between[i][j] < 1e300) {
        neighbours.values.push_back(static_cast<Index>(j));
        lengths.push_back(between[i][j]);
      }
    neighbours.offsets.push_back(neighbours.values.size());
  }
  const auto direct = between;
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) between[i][j] = std::min(between[i][j], between[i][k] + between[k][j]);
  const ShortestPaths paths = shortest_paths(neighbours, lengths, {5, 17});
  for (std::size_t i = 0; i < n; ++i) {
    const double expected = std::min(between[5][i], between[17][i]);
    if (expected > 1e200) {
      EXPECT_TRUE(std::isinf(paths.distance[i]));
      EXPECT_EQ(paths.previous[i], i);
      continue;
    }
    EXPECT_NEAR(paths.distance[i], expected, 1e-12);
    const Index p = paths.previous[i];
    if (p != i) {
      EXPECT_NEAR(paths.distance[p] + direct[p][i], expected, 1e-12);
    }
  }
}

struct Prepared {
  std::vector<Vec3> points;
  PointGraph graph;
  LevelSections sections;
};

Prepared prepare(std::vector<Vec3> points) {
  Prepared p{std::move(points), {}, {}};
  p.graph = build_point_graph(p.points);
  Index lowest = 0;
  for (Index i = 0; i < p.points.size(); ++i)
    if (p.points[i].z < p.points[lowest].z) lowest = i;
  p.sections = level_sections(p.points, p.graph.neighbours, {lowest}, 3 * p.graph.spacing);
  return p;
}

// A trunk with a thin branch.
Prepared forked_tree() {
  std::vector<Vec3> points = cylinder_points({0, 0, 0}, {0, 0, 1}, 0.05, 1, 12000);
  const std::vector<Vec3> branch = cylinder_points({0.05, 0, 0.5}, {1, 0, 0.5}, 0.015, 0.5, 2500, 0, 1, 2);
  points.insert(points.end(), branch.begin(), branch.end());
  return prepare(std::move(points));
}

TEST(LevelSections, HoldAllPointsAndHangTogether) {
  const Prepared p = forked_tree();
  ASSERT_EQ(p.graph.components, 1u);
  std::vector<std::size_t> size(p.sections.count, 0);
  for (const Index s : p.sections.section) {
    ASSERT_LT(s, p.sections.count);
    ++size[s];
  }
  EXPECT_EQ(std::count(size.begin(), size.end(), 0u), 0);
  // Around the trunk there is one section at each height, not several patches.
  std::set<Index> at_mid_trunk;
  for (std::size_t i = 0; i < p.points.size(); ++i)
    if (std::abs(p.points[i].z - 0.3) < 0.001) at_mid_trunk.insert(p.sections.section[i]);
  EXPECT_LE(at_mid_trunk.size(), 2u);
}

void expect_connected(const Prepared& p, const Clusters& clusters) {
  const std::size_t count = clusters.cylinders.size();
  std::vector<Index> seen(count, 0);
  std::vector<char> done(p.points.size(), 0);
  for (Index start = 0; start < p.points.size(); ++start) {
    const Index c = clusters.label[start];
    if (c == kNone || done[start]) continue;
    ++seen[c];
    std::vector<Index> stack{start};
    done[start] = 1;
    while (!stack.empty()) {
      const Index i = stack.back();
      stack.pop_back();
      for (const Index* j = p.graph.neighbours.begin(i); j != p.graph.neighbours.end(i); ++j)
        if (!done[*j] && clusters.label[*j] == c) {
          done[*j] = 1;
          stack.push_back(*j);
        }
    }
  }
  for (std::size_t c = 0; c < count; ++c) EXPECT_EQ(seen[c], 1u) << "parts of cluster " << c;
}

TEST(Clusters, HangTogetherAndAreTightWhereFixed) {
  const Prepared p = forked_tree();
  ClusterOptions options;
  const Clusters clusters =
      cluster_points(p.points, p.graph.neighbours, p.sections.section, p.sections.distance, options);
  EXPECT_EQ(std::count(clusters.label.begin(), clusters.label.end(), kNone), 0);
  expect_connected(p, clusters);
  std::vector<std::vector<Vec3>> members(clusters.cylinders.size());
  for (std::size_t i = 0; i < p.points.size(); ++i) members[clusters.label[i]].push_back(p.points[i]);
  std::size_t fixed = 0;
  for (std::size_t c = 0; c < members.size(); ++c) {
    ASSERT_FALSE(members[c].empty());
    if (clusters.fixed[c]) ++fixed;
  }
  EXPECT_GT(10 * fixed, 8 * members.size());
}

// Of a trunk alone the clusters go all around: their circles are the trunk's.
TEST(Clusters, GoAroundAThickBranch) {
  const Prepared p = prepare(cylinder_points({0.5, 0.5, 0}, {0, 0, 1}, 0.05, 1, 15000, 0.001));
  const Clusters clusters = cluster_points(p.points, p.graph.neighbours, p.sections.section, p.sections.distance, {});
  for (const BranchCylinder& c : clusters.cylinders) {
    EXPECT_NEAR(c.radius, 0.05, 0.005);
    EXPECT_NEAR(std::hypot(c.centre.x - 0.5, c.centre.y - 0.5), 0, 0.01);
  }
}

TEST(Clusters, BoundsHold) {
  const Prepared p = forked_tree();
  ClusterOptions small;
  small.max_points = 100;
  const Clusters split = cluster_points(p.points, p.graph.neighbours, p.sections.section, p.sections.distance, small);
  const Clusters whole = cluster_points(p.points, p.graph.neighbours, p.sections.section, p.sections.distance, {});
  EXPECT_GT(split.cylinders.size(), 1.5 * static_cast<double>(whole.cylinders.size()));
  small.most = p.sections.count + 10;
  const Clusters bounded = cluster_points(p.points, p.graph.neighbours, p.sections.section, p.sections.distance, small);
  EXPECT_LE(bounded.cylinders.size(), small.most);
  expect_connected(p, split);
}

// A ball is no cylinder: it is split as far as its points go.
TEST(Clusters, WhatIsNoCylinderIsSplit) {
  Random random(4);
  std::vector<Vec3> points;
  while (points.size() < 3000) {
    const Vec3 p{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5};
    if (norm(p) < 0.5) points.push_back(p);
  }
  const PointGraph graph = build_point_graph(points);
  const std::vector<double> height = [&] {
    std::vector<double> z;
    for (const Vec3& p : points) z.push_back(p.z);
    return z;
  }();
  ClusterOptions options;
  options.delta = 0.01;
  const Clusters clusters =
      cluster_points(points, graph.neighbours, std::vector<Index>(points.size(), 0), height, options);
  EXPECT_GT(clusters.cylinders.size(), 50u);
}

}  // namespace
}  // namespace bisector
