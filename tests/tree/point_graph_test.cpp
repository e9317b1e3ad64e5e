#include "tree/point_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "bisector/error.h"
#include "core/parallel.h"
#include "core/random.h"

namespace bisector {
namespace {

std::vector<Vec3> random_points(std::size_t count, const Vec3& corner, double size, std::uint64_t seed) {
  Random random(seed);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = random.uniform(), y = random.uniform(), z = random.uniform();
    points.push_back(corner + size * Vec3{x, y, z});
  }
  return points;
}

std::vector<Vec3> joined(std::vector<Vec3> a, const std::vector<Vec3>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

bool has_edge(const Csr<Index>& neighbours, Index a, Index b) {
  return std::binary_search(neighbours.begin(a), neighbours.end(a), b);
}

TEST(PointGraph, JoinsEachPointToItsNearestOnes) {
  const std::vector<Vec3> points = random_points(400, {1e6, -2e6, 5}, 3, 1);
  const std::size_t k = 8;
  const PointGraph graph = build_point_graph(points, k);
  std::vector<double> reach;
  for (Index i = 0; i < points.size(); ++i) {
    std::vector<double> distances;
    for (Index j = 0; j < points.size(); ++j)
      if (j != i) distances.push_back(norm(points[j] - points[i]));
    std::sort(distances.begin(), distances.end());
    reach.push_back(distances[k - 1]);
  }
  for (Index i = 0; i < points.size(); ++i)
    for (Index j = 0; j < points.size(); ++j) {
      const bool near = i != j && norm(points[j] - points[i]) <= std::max(reach[i], reach[j]);
      EXPECT_EQ(has_edge(graph.neighbours, i, j), near) << i << " " << j;
    }
  std::nth_element(reach.begin(), reach.begin() + static_cast<std::ptrdiff_t>(reach.size() / 2), reach.end());
  EXPECT_DOUBLE_EQ(graph.spacing, reach[reach.size() / 2]);
}

TEST(PointGraph, FewPointsAreAllNeighbours) {
  const std::vector<Vec3> points = random_points(5, {}, 1, 2);
  const PointGraph graph = build_point_graph(points, 8);
  for (Index i = 0; i < 5; ++i) EXPECT_EQ(graph.neighbours.size(i), 4u);
  EXPECT_EQ(graph.components, 1u);
}

TEST(PointGraph, ManyPointsAtOnePlaceAreNoFailure) {
  std::vector<Vec3> points(50, Vec3{1, 2, 3});
  points.push_back({2, 2, 3});
  const PointGraph graph = build_point_graph(points);
  EXPECT_EQ(graph.neighbours.rows(), 51u);
  EXPECT_GE(graph.neighbours.size(50), 8u);
}

TEST(PointGraph, ComponentsAreThoseThatPathsConnect) {
  const std::vector<Vec3> points = joined(joined(random_points(60, {}, 1, 3), random_points(40, {10, 0, 0}, 1, 4)),
                                          random_points(30, {0, 30, 0}, 1, 5));
  const PointGraph graph = build_point_graph(points);
  ASSERT_EQ(graph.components, 3u);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(graph.component[i], i < 60 ? 0u : i < 100 ? 1u : 2u);
}

// Kruskal's over all pairs of points.
double spanning_length(const std::vector<Vec3>& points, std::vector<Index> component) {
  struct Pair {
    double length;
    Index a, b;
  };
  std::vector<Pair> pairs;
  for (Index a = 0; a < points.size(); ++a)
    for (Index b = a + 1; b < points.size(); ++b)
      if (component[a] != component[b]) pairs.push_back({norm(points[a] - points[b]), a, b});
  std::sort(pairs.begin(), pairs.end(), [](const Pair& x, const Pair& y) { return x.length < y.length; });
  double sum = 0;
  for (const Pair& p : pairs) {
    const Index from = component[p.a], to = component[p.b];
    if (from == to) continue;
    sum += p.length;
    std::replace(component.begin(), component.end(), from, to);
  }
  return sum;
}

TEST(PointGraph, BridgesAreTheShortestThatConnectAll) {
  Random random(7);
  std::vector<Vec3> points;
  for (int k = 0; k < 14; ++k) {
    const double x = 20 * random.uniform(), y = 20 * random.uniform(), z = 20 * random.uniform();
    points = joined(points, random_points(k == 0 ? 200 : 12, {x, y, z}, 0.8, 20 + static_cast<std::uint64_t>(k)));
  }
  const PointGraph graph = build_point_graph(points);
  ASSERT_GT(graph.components, 5u);
  const std::vector<Bridge> bridges = shortest_bridges(points, graph);
  ASSERT_EQ(bridges.size(), graph.components - 1);
  double sum = 0;
  std::vector<std::array<Index, 2>> edges;
  for (const Bridge& b : bridges) {
    EXPECT_NE(graph.component[b.from], graph.component[b.to]);
    EXPECT_DOUBLE_EQ(b.length, norm(points[b.from] - points[b.to]));
    sum += b.length;
    edges.push_back({b.from, b.to});
  }
  EXPECT_TRUE(std::is_sorted(bridges.begin(), bridges.end(),
                             [](const Bridge& a, const Bridge& b) { return a.length < b.length; }));
  EXPECT_NEAR(sum, spanning_length(points, graph.component), 1e-9 * sum);

  const Csr<Index> connected = add_edges(graph.neighbours, edges);
  std::set<Index> reached{0};
  std::vector<Index> stack{0};
  while (!stack.empty()) {
    const Index i = stack.back();
    stack.pop_back();
    for (const Index* j = connected.begin(i); j != connected.end(i); ++j)
      if (reached.insert(*j).second) stack.push_back(*j);
  }
  EXPECT_EQ(reached.size(), points.size());
}

TEST(PointGraph, TwoFarHalvesTakeNoQuadraticTime) {
  const std::vector<Vec3> points = joined(random_points(40000, {}, 1, 8), random_points(40000, {1000, 0, 0}, 1, 9));
  const PointGraph graph = build_point_graph(points);
  ASSERT_EQ(graph.components, 2u);
  ASSERT_EQ(shortest_bridges(points, graph).size(), 1u);  // all pairs would take minutes
}

TEST(PointGraph, SameForAnyNumberOfThreads) {
  const std::vector<Vec3> points = joined(random_points(3000, {}, 1, 10), random_points(500, {3, 0, 0}, 1, 11));
  const PointGraph all = build_point_graph(points);
  const ThreadLimit limit(1);
  const PointGraph one = build_point_graph(points);
  EXPECT_EQ(one.neighbours.values, all.neighbours.values);
  EXPECT_EQ(one.component, all.component);
  EXPECT_EQ(one.spacing, all.spacing);
}

TEST(PointGraph, RefusesWhatIsNoCloud) {
  EXPECT_THROW(build_point_graph({}), Error);
  EXPECT_THROW(build_point_graph({{1, 2, 3}}), Error);
  EXPECT_THROW(build_point_graph({{1, 2, 3}, {0, std::numeric_limits<double>::quiet_NaN(), 0}}), Error);
  EXPECT_THROW(build_point_graph({{1, 2, 3}, {0, 0, std::numeric_limits<double>::infinity()}}), Error);
}

}  // namespace
}  // namespace bisector
