// Gaps between feature curves, and what is left of the curves at a given width.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "features/curve_network.h"
#include "features/curves.h"
#include "features/simplify.h"
#include "mesh/topology.h"
#include "support/featured.h"

namespace bisector::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Open curves between corners, as chains of points.
struct Chains {
  std::vector<Vec3> points;
  FeatureGraph graph;

  Index corner(const Vec3& p) {
    points.push_back(p);
    graph.corners.push_back(static_cast<Index>(points.size() - 1));
    return graph.corners.back();
  }
  void curve(Index a, Index b, FeatureKind kind = FeatureKind::crease) {
    graph.curves.push_back({{a, b}, false, kind});
    graph.edges.push_back({std::min(a, b), std::max(a, b)});
    std::sort(graph.edges.begin(), graph.edges.end());
  }
};

// All shortest ways between a network's points by Floyd and Warshall, over links between points next to each other.
std::vector<std::vector<CurveNetwork::Way>> all_ways(const FeatureCurves& curves, const CurveNetwork& network) {
  const std::size_t count = network.points().size(), corners = curves.graph().corners.size();
  std::vector<std::vector<CurveNetwork::Way>> ways(count, std::vector<CurveNetwork::Way>(count, {kInfinity, 0}));
  const auto link = [&](Index a, Index b, double length) {
    ways[a][b] = ways[b][a] = std::min(ways[a][b], CurveNetwork::Way{length, 0});
  };
  for (Index p = 0; p < count; ++p) ways[p][p] = {0, 0};
  for (Index c = 0; c < curves.size(); ++c) {
    std::vector<Index> on;
    for (auto p = static_cast<Index>(corners); p < count; ++p)
      if (network.curve(p) == c) on.push_back(p);
    for (std::size_t k = 1; k < on.size(); ++k)
      link(on[k - 1], on[k], network.position(on[k]) - network.position(on[k - 1]));
    const double rest = curves.length(c) - network.position(on.back());
    if (curves.closed(c)) {
      link(on.back(), on.front(), rest + network.position(on.front()));
    } else {
      link(curves.ends(c)[0], on.front(), network.position(on.front()));
      link(on.back(), curves.ends(c)[1], rest);
    }
  }
  for (Index k = 0; k < count; ++k)
    for (Index a = 0; a < count; ++a)
      for (Index b = 0; b < count; ++b) {
        if (a == k || b == k) continue;
        const auto &first = ways[a][k], &second = ways[k][b];
        const Index between = first.corners + second.corners + (k < corners ? 1 : 0);
        ways[a][b] = std::min(ways[a][b], CurveNetwork::Way{first.length + second.length, between});
      }
  return ways;
}

TEST(CurveNetwork, WaysAreTheShortest) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    Chains chains;
    for (int k = 0; k < 9; ++k) chains.corner({unit(random), unit(random), unit(random)});
    for (int k = 0; k < 13; ++k) {
      // Some curves join corners that others join, or come back to their own.
      const Index a = k % 9, b = k == 4 ? a : static_cast<Index>(random() % 9);
      chains.points.push_back({unit(random), unit(random), unit(random)});
      const auto middle = static_cast<Index>(chains.points.size() - 1);
      chains.points.push_back({unit(random), unit(random), unit(random)});
      chains.graph.curves.push_back({{a, middle, middle + 1, b}});
    }
    for (int k = 0; k < 3; ++k) chains.points.push_back({unit(random), unit(random), unit(random)});
    const auto last = static_cast<Index>(chains.points.size() - 1);
    chains.graph.curves.push_back({{last - 2, last - 1, last}, true});
    const FeatureCurves curves(chains.graph, chains.points);
    const CurveNetwork network(curves, 0.2);
    const auto expected = all_ways(curves, network);
    CurveNetwork::Search search(network);
    for (const double reach : {0.4, 1.5, 100.0})
      for (Index a = 0; a < expected.size(); ++a) {
        search.start(a, reach);
        for (Index b = 0; b < expected.size(); ++b) {
          const CurveNetwork::Way way = search.to(b);
          if (expected[a][b].length > reach) {
            EXPECT_EQ(way.length, kInfinity);
            continue;
          }
          EXPECT_NEAR(way.length, expected[a][b].length, 1e-12);
          EXPECT_EQ(way.corners, expected[a][b].corners) << a << " to " << b;
        }
      }
  }
}

std::vector<double> gaps_of(const CurveNetwork& network, double reach) {
  return curve_gaps(network, std::vector<double>(network.points().size(), reach));
}

TEST(CurveGaps, BetweenParallelLinesAreTheirDistance) {
  for (const double distance : {0.1, 0.3}) {
    Chains lines;
    lines.curve(lines.corner({0, 0, 0}), lines.corner({4, 0, 0}));
    lines.curve(lines.corner({0, distance, 0}), lines.corner({4, distance, 0}));
    const CurveNetwork network(FeatureCurves(lines.graph, lines.points), 0.01);
    for (const double gap : gaps_of(network, 1)) EXPECT_NEAR(gap, distance, 1e-12);
    for (const double gap : gaps_of(network, 0.05)) EXPECT_EQ(gap, kInfinity);
  }
}

TEST(CurveGaps, AreNoneAroundACircleOrAtARightAngle) {
  std::vector<Vec3> points;
  FeatureGraph circle;
  circle.curves.push_back({{}, true});
  for (Index k = 0; k < 200; ++k) {
    const double angle = 2 * std::numbers::pi * k / 200;
    points.push_back({std::cos(angle), std::sin(angle), 0});
    circle.curves[0].vertices.push_back(k);
  }
  for (const double gap : gaps_of(CurveNetwork(FeatureCurves(circle, points), 0.05), 3)) EXPECT_EQ(gap, kInfinity);

  Chains corner;
  const Index middle = corner.corner({0, 0, 0});
  corner.curve(middle, corner.corner({1, 0, 0}));
  corner.curve(middle, corner.corner({0, 1, 0}));
  for (const double gap : gaps_of(CurveNetwork(FeatureCurves(corner.graph, corner.points), 0.05), 3))
    EXPECT_EQ(gap, kInfinity);
}

// Calls body with the distance from the corner and the gap for each point of two straight curves, 2 long, that leave a
// corner at an angle in radians.
template <class Body>
void for_gaps_of_wedge(double angle, double reach, const Body& body) {
  Chains corner;
  const Index tip = corner.corner({0, 0, 0});
  corner.curve(tip, corner.corner({2, 0, 0}));
  corner.curve(tip, corner.corner({2 * std::cos(angle), 2 * std::sin(angle), 0}));
  const CurveNetwork network(FeatureCurves(corner.graph, corner.points), 0.005);
  const std::vector<double> gaps = gaps_of(network, reach);
  for (Index p = 0; p < gaps.size(); ++p) body(norm(network.points()[p]), gaps[p]);
}

// Of the other curve only what is far along it counts near the corner; beyond, the gap grows with the distance.
TEST(CurveGaps, AtAnAcuteAngleBeginAwayFromTheCorner) {
  const double angle = 0.4, reach = 0.3;
  for_gaps_of_wedge(angle, reach, [&](double along, double gap) {
    const double other = std::max(along * std::cos(angle), kDetour * reach - along);
    const double expected = std::hypot(other * std::cos(angle) - along, other * std::sin(angle));
    if (expected > 1.05 * reach) {
      EXPECT_EQ(gap, kInfinity);
    } else if (expected < 0.95 * reach && along < 1.8) {
      EXPECT_NEAR(gap, expected, 0.01);
    }
  });
}

// A strip that ends in a corner is one up to there.
TEST(CurveGaps, OfAStripReachTheCorner) {
  const double angle = 0.1;
  for_gaps_of_wedge(angle, 0.3, [&](double along, double gap) {
    if (along > 0 && along < 1.9) {
      EXPECT_NEAR(gap, along * std::sin(angle), 0.003);
    }
  });
}

// Every curve runs along edges of the input's features, its ends are corners, and corners are apart.
void expect_sound(const FeatureGraph& left, const FeatureGraph& input) {
  for (const std::array<Index, 2>& edge : left.edges)
    EXPECT_TRUE(std::binary_search(input.edges.begin(), input.edges.end(), edge));
  std::set<std::array<Index, 2>> used;
  for (const FeatureCurve& curve : left.curves) {
    const std::size_t count = curve.vertices.size();
    for (std::size_t k = 0; k + (curve.closed ? 0 : 1) < count; ++k) {
      const Index a = curve.vertices[k], b = curve.vertices[(k + 1) % count];
      used.insert({std::min(a, b), std::max(a, b)});
    }
    if (curve.closed) continue;
    for (const Index end : {curve.vertices.front(), curve.vertices.back()})
      EXPECT_TRUE(std::binary_search(left.corners.begin(), left.corners.end(), end));
  }
  EXPECT_EQ(std::vector(used.begin(), used.end()), left.edges);
}

SimplifiedFeatures simplified(const TriangleMesh& mesh, const FeatureGraph& graph, double width) {
  return simplify_features(graph, mesh.vertices, curve_weights(graph, mesh.triangles, mesh.vertices), width);
}

TEST(SimplifiedFeatures, AreTheInputsWhereNothingIsNarrow) {
  for (const FeaturedModel& model : featured_models()) {
    const FeatureGraph graph = sharp_graph(model.mesh);
    const SimplifiedFeatures none = simplified(model.mesh, graph, 0);
    EXPECT_EQ(none.graph.edges, graph.edges);
    EXPECT_EQ(none.graph.corners, graph.corners);
    const SimplifiedFeatures fine = simplified(model.mesh, graph, 0.004);
    EXPECT_EQ(fine.graph.edges, graph.edges) << model.name;
    EXPECT_EQ(fine.merged + fine.let_go, 0u) << model.name;
  }
}

// A slab has two narrow walls along its whole length: twice two curves, of which one remains each.
TEST(SimplifiedFeatures, OfANarrowWallIsOneCurve) {
  const TriangleMesh slab = prism({{0, 0}, {2, 0}, {2, 0.02}, {0, 0.02}});
  FeatureGraph graph = sharp_graph(slab);
  for (FeatureCurve& curve : graph.curves) curve.kind = FeatureKind::crease;
  ASSERT_EQ(graph.curves.size(), 12u);
  const SimplifiedFeatures left = simplified(slab, graph, 0.1);
  expect_sound(left.graph, graph);
  EXPECT_EQ(left.graph.corners.size(), 4u);
  EXPECT_EQ(left.graph.curves.size(), 4u);
  EXPECT_EQ(left.merged, 8u);
  EXPECT_EQ(left.let_go, 0u);
  for (Index a = 0; a < 4; ++a)
    for (Index b = 0; b < a; ++b)
      EXPECT_GT(norm(slab.vertices[left.graph.corners[a]] - slab.vertices[left.graph.corners[b]]), 0.9);
}

TEST(SimplifiedFeatures, KeepCurvesThatAreNoCreases) {
  for (const FeatureKind kind :
       {FeatureKind::border, FeatureKind::label, FeatureKind::given, FeatureKind::non_manifold}) {
    Chains lines;
    lines.curve(lines.corner({0, 0, 0}), lines.corner({4, 0, 0}), kind);
    lines.curve(lines.corner({0, 0.1, 0}), lines.corner({4, 0.1, 0}), kind);
    const SimplifiedFeatures left = simplify_features(lines.graph, lines.points, {1, 1}, 0.5);
    EXPECT_EQ(left.graph.edges, lines.graph.edges);
    EXPECT_EQ(left.merged + left.let_go, 0u);
  }
}

TEST(SimplifiedFeatures, OfParallelCreasesTheHeavierStays) {
  for (const int heavier : {0, 1}) {
    Chains lines;
    lines.curve(lines.corner({0, 0, 0}), lines.corner({4, 0, 0}));
    lines.curve(lines.corner({0, 0.1, 0}), lines.corner({4, 0.1, 0}));
    const SimplifiedFeatures left =
        simplify_features(lines.graph, lines.points, {heavier == 0 ? 2.0 : 1.0, heavier == 0 ? 1.0 : 2.0}, 0.5);
    ASSERT_EQ(left.graph.curves.size(), 1u);
    EXPECT_EQ(lines.points[left.graph.curves[0].vertices[0]].y, heavier == 0 ? 0 : 0.1);
    EXPECT_EQ(left.merged, 1u);
  }
}

// Curves that are led to the same corner along the same edges: as long as these fit into the corner's cell they share
// them; else one has them, and the others end where they meet it.
TEST(SimplifiedFeatures, DoNotRunAlongTheSameEdges) {
  const double width = 0.5;
  for (const double shared : {0.1, 0.3}) {
    Chains net;
    const Index a = net.corner({0, 0, 0}), b = net.corner({0, shared, 0});
    const std::vector<Vec3> far{{-3, 0, 0}, {3, 0, 0}, {-1, 3, 0}, {1, 3, 0}, {3, 2, 0}};
    std::vector<double> weights{0.1};
    net.curve(a, b);
    for (std::size_t k = 0; k < far.size(); ++k) {
      net.curve(k < 2 ? a : b, net.corner(far[k]));
      weights.push_back(3 + static_cast<double>(k));
    }
    const SimplifiedFeatures left = simplify_features(net.graph, net.points, weights, width);
    expect_sound(left.graph, net.graph);
    EXPECT_EQ(left.merged, 1u);
    std::map<std::array<Index, 2>, int> uses;
    std::set<Index> corners;
    for (const FeatureCurve& curve : left.graph.curves) {
      corners.insert({curve.vertices.front(), curve.vertices.back()});
      for (std::size_t k = 1; k < curve.vertices.size(); ++k) {
        const auto [u, v] = std::minmax(curve.vertices[k - 1], curve.vertices[k]);
        ++uses[{u, v}];
      }
    }
    const bool fits = shared < 0.25 * width;
    for (const auto& [edge, count] : uses) EXPECT_TRUE(count == 1 || fits) << edge[0] << " " << edge[1];
    EXPECT_EQ(corners.contains(a) && corners.contains(b), !fits);
    EXPECT_EQ(left.graph.curves.size(), fits ? 5u : 6u);
  }
}

// A curve that ends on one side of a narrow strip is led to the corner that remains.
TEST(SimplifiedFeatures, LeadCurvesToTheCornerThatRemains) {
  Chains net;
  const Index a = net.corner({0, 0, 0}), b = net.corner({0, 0.1, 0});
  const Index left = net.corner({-3, 0, 0}), right = net.corner({3, 0, 0}), up = net.corner({0, 3, 0}),
              side = net.corner({1, 3, 0});
  net.curve(a, b);
  net.curve(left, a);
  net.curve(a, right);
  net.curve(b, up);
  net.curve(b, side);
  const SimplifiedFeatures merged = simplify_features(net.graph, net.points, {0.1, 3, 3, 3, 3}, 0.5);
  expect_sound(merged.graph, net.graph);
  EXPECT_EQ(merged.merged, 1u);
  EXPECT_EQ(merged.graph.corners.size(), 5u);
  std::set<Index> inner;
  for (const FeatureCurve& curve : merged.graph.curves)
    for (const Index v : {curve.vertices.front(), curve.vertices.back()})
      if (v == a || v == b) inner.insert(v);
  EXPECT_EQ(inner.size(), 1u);
  EXPECT_EQ(merged.graph.curves.size(), 4u);
}

// A curve that is led to another corner by a way that it runs back beside has a corner where it turns.
TEST(SimplifiedFeatures, HaveCornersWhereTheyTurnBack) {
  for (const int degrees : {10, 40, 80, 100, 140, 170}) {
    Chains net;
    const double angle = degrees * std::numbers::pi / 180;
    const Index a = net.corner({0, 0, 0}), b = net.corner({0.3, 0, 0});
    const Index far = net.corner({0.3 - 4 * std::cos(angle), 4 * std::sin(angle), 0});
    net.curve(a, b);
    net.curve(b, far);
    for (const Vec3& p : {Vec3{-3, -3, 0}, Vec3{0, -3, 0}, Vec3{3, -3, 0}}) net.curve(a, net.corner(p));
    const SimplifiedFeatures led = simplify_features(net.graph, net.points, {0.1, 1, 3, 3, 3}, 0.5);
    expect_sound(led.graph, net.graph);
    EXPECT_EQ(led.merged, 1u);
    EXPECT_TRUE(std::binary_search(led.graph.corners.begin(), led.graph.corners.end(), a));
    EXPECT_EQ(std::binary_search(led.graph.corners.begin(), led.graph.corners.end(), b), degrees < 90) << degrees;
    EXPECT_EQ(led.graph.curves.size(), degrees < 90 ? 5u : 4u);
  }
}

// Where nothing else meets such a way, the curve ends where it would turn back.
TEST(SimplifiedFeatures, EndWhereTheyTurnBackToACornerOfTheirOwn) {
  for (const bool from_far : {false, true})
    for (const int degrees : {10, 40, 80, 100, 170}) {
      Chains net;
      const double angle = degrees * std::numbers::pi / 180;
      const Index a = net.corner({0, 0, 0}), b = net.corner({0.3, 0, 0});
      const Index far = net.corner({0.3 - 4 * std::cos(angle), 4 * std::sin(angle), 0});
      net.curve(a, b);
      from_far ? net.curve(far, b) : net.curve(b, far);
      const SimplifiedFeatures led = simplify_features(net.graph, net.points, {0.1, 1}, 0.5);
      expect_sound(led.graph, net.graph);
      ASSERT_EQ(led.graph.curves.size(), 1u) << degrees << " " << from_far << " merged " << led.merged;
      EXPECT_EQ(led.graph.corners, (degrees < 90 ? std::vector<Index>{b, far} : std::vector<Index>{a, far})) << degrees;
    }
}

// A crease that goes along both long edges of a needle takes the short way across it. Beside a wider triangle it
// stays.
TEST(SimplifiedFeatures, HaveNoTipsOfNeedles) {
  for (const double height : {0.01, 1.0}) {
    Chains net;
    const Index a = net.corner({0, 0, 0}), d = net.corner({5, height + 1, 0}), b = 2, c = 3;
    net.points.insert(net.points.end(), {{2, 0, 0}, {1.3, height, 0}});
    net.graph.curves.push_back({{a, b, c, d}, false, FeatureKind::crease});
    net.graph.edges = edges_of(net.graph.curves);
    const bool is_needle = height < 0.1;
    const std::vector<Triangle> needle{{a, b, c}};
    const SimplifiedFeatures cut =
        simplify_features(net.graph, net.points, {1}, 0.5, {}, vertex_neighbours(needle, net.points.size()));
    if (is_needle) {
      ASSERT_EQ(cut.graph.curves.size(), 1u);
      EXPECT_EQ(cut.graph.curves[0].vertices, (std::vector<Index>{a, c, d}));
    } else {
      EXPECT_EQ(cut.graph.edges, net.graph.edges);
    }
  }
}

// A plane of squares on which two curves end near each other, at right angles, with a vertex in between.
TEST(SimplifiedFeatures, MeetWhereTheyAllButDo) {
  const int n = 20;
  const TriangleMesh plane = grid_patch(n, n);
  const auto at = [&](int x, int y) {
    return static_cast<Index>(std::find(plane.vertices.begin(), plane.vertices.end(), Vec3{double(x), double(y), 0}) -
                              plane.vertices.begin());
  };
  FeatureGraph graph;
  for (const bool first : {true, false}) {
    FeatureCurve curve{{}, false, FeatureKind::crease};
    for (int k = 0; k <= 8; ++k) curve.vertices.push_back(first ? at(10, 10 - k) : at(12 + k, 10));
    graph.corners.insert(graph.corners.end(), {curve.vertices.front(), curve.vertices.back()});
    for (std::size_t k = 1; k < curve.vertices.size(); ++k)
      graph.edges.push_back(sorted_edge(curve.vertices[k - 1], curve.vertices[k]));
    graph.curves.push_back(std::move(curve));
  }
  std::sort(graph.corners.begin(), graph.corners.end());
  std::sort(graph.edges.begin(), graph.edges.end());
  const Csr<Index> neighbours = vertex_neighbours(plane.triangles, plane.vertices.size());
  EXPECT_TRUE(corner_links(graph, plane.vertices, neighbours, 1.9).empty());
  const std::vector<std::vector<Index>> links = corner_links(graph, plane.vertices, neighbours, 3);
  ASSERT_EQ(links.size(), 1u);
  EXPECT_EQ(std::set<Index>({links[0].front(), links[0].back()}), std::set<Index>({at(10, 10), at(12, 10)}));
  EXPECT_EQ(links[0][1], at(11, 10));
  for (const double width : {1.5, 2.5}) {
    const SimplifiedFeatures met = simplify_features(graph, plane.vertices, {8, 8}, width, links, neighbours);
    EXPECT_EQ(met.graph.curves.size(), 2u);
    EXPECT_EQ(met.graph.corners.size(), width > 2 ? 3u : 4u);
  }
}

// What lies on a curve leads to no other corner: the curve does.
TEST(CornerLinks, DoNotRunAlongCurves) {
  const TriangleMesh plane = grid_patch(4, 1);
  FeatureGraph graph;
  FeatureCurve curve{{}, false, FeatureKind::crease};
  for (int x = 0; x <= 4; ++x)
    for (Index v = 0; v < plane.vertices.size(); ++v)
      if (plane.vertices[v] == Vec3{double(x), 0, 0}) curve.vertices.push_back(v);
  for (std::size_t k = 1; k < curve.vertices.size(); ++k)
    graph.edges.push_back(sorted_edge(curve.vertices[k - 1], curve.vertices[k]));
  std::sort(graph.edges.begin(), graph.edges.end());
  graph.corners = {curve.vertices.front(), curve.vertices.back()};
  std::sort(graph.corners.begin(), graph.corners.end());
  graph.curves = {curve};
  const Csr<Index> neighbours = vertex_neighbours(plane.triangles, plane.vertices.size());
  const std::vector<std::vector<Index>> ways = corner_links(graph, plane.vertices, neighbours, 10);
  EXPECT_EQ(ways.size(), 1u);
  for (const std::vector<Index>& way : ways)
    for (std::size_t k = 1; k + 1 < way.size(); ++k) EXPECT_EQ(plane.vertices[way[k]].y, 1);
}

TEST(SimplifiedFeatures, DoNotDependOnWhichWayCurvesRun) {
  const TriangleMesh slab = prism({{0, 0}, {2, 0}, {2, 0.02}, {0, 0.02}});
  const FeatureGraph graph = sharp_graph(slab);
  FeatureGraph turned = graph;
  for (FeatureCurve& curve : turned.curves) std::reverse(curve.vertices.begin(), curve.vertices.end());
  EXPECT_EQ(simplified(slab, graph, 0.1).graph.edges, simplified(slab, turned, 0.1).graph.edges);
}

// Two halves of a circle that run on into each other are one closed curve.
TEST(SimplifiedFeatures, OfTwoHalvesAreAClosedCurve) {
  constexpr Index kCount = 40;
  std::vector<Vec3> points;
  FeatureGraph halves;
  halves.corners = {0, kCount / 2};
  halves.curves.assign(2, {});
  for (Index k = 0; k < kCount; ++k) {
    const double angle = 2 * std::numbers::pi * k / kCount;
    points.push_back({std::cos(angle), std::sin(angle), 0});
  }
  for (Index k = 0; k <= kCount / 2; ++k) {
    halves.curves[0].vertices.push_back(k);
    halves.curves[1].vertices.push_back((k + kCount / 2) % kCount);
  }
  for (FeatureCurve& curve : halves.curves) curve.kind = FeatureKind::crease;
  halves.edges = edges_of(halves.curves);
  const SimplifiedFeatures left = simplify_features(halves, points, {1, 1}, 0.1);
  ASSERT_EQ(left.graph.curves.size(), 1u);
  EXPECT_TRUE(left.graph.curves[0].closed);
  EXPECT_EQ(left.graph.curves[0].vertices.size(), kCount);
  EXPECT_EQ(left.graph.edges, halves.edges);
  EXPECT_TRUE(left.graph.corners.empty());
}

// A flat grid of squares 0.1 wide, x from 0 to 8 and y from -2 to 4, with creases along its lines.
class CreasesOnAGrid {
 public:
  CreasesOnAGrid() {
    for (int y = 0; y <= kRows; ++y)
      for (int x = 0; x <= kColumns; ++x) points_.push_back({0.1 * x, 0.1 * y - 2, 0});
    std::vector<Triangle> triangles;
    for (int y = 0; y < kRows; ++y)
      for (int x = 0; x < kColumns; ++x) {
        const Index v = at(x, y), up = at(x, y + 1);
        triangles.push_back({v, v + 1, up + 1});
        triangles.push_back({v, up + 1, up});
      }
    neighbours_ = vertex_neighbours(triangles, points_.size());
  }

  // Through points that are joined by lines of the grid, in units of 0.1.
  void crease(const std::vector<std::array<int, 2>>& stations, double weight) {
    FeatureCurve curve;
    curve.kind = FeatureKind::crease;
    auto [x, y] = stations[0];
    curve.vertices.push_back(at(x, y + 20));
    for (const auto& [to_x, to_y] : stations)
      while (x != to_x || y != to_y) {
        x += (to_x > x) - (to_x < x);
        y += (to_y > y) - (to_y < y);
        curve.vertices.push_back(at(x, y + 20));
      }
    for (const Index end : {curve.vertices.front(), curve.vertices.back()}) graph_.corners.push_back(end);
    graph_.curves.push_back(curve);
    graph_.edges = edges_of(graph_.curves);
    weights_.push_back(weight);
  }

  SimplifiedFeatures at_width(double width) const {
    return simplify_features(graph_, points_, weights_, width, {}, neighbours_);
  }
  const Vec3& point(Index v) const { return points_[v]; }
  double length(const FeatureGraph& graph) const {
    double sum = 0;
    for (const auto& [a, b] : graph.edges) sum += norm(points_[a] - points_[b]);
    return sum;
  }

 private:
  static constexpr int kColumns = 80, kRows = 60;
  static Index at(int x, int y) { return static_cast<Index>(y * (kColumns + 1) + x); }

  std::vector<Vec3> points_;
  Csr<Index> neighbours_;
  FeatureGraph graph_;
  std::vector<double> weights_;
};

// Ends of curves that are no corner of the input and where no other curve ends.
int count_loose_ends(const SimplifiedFeatures& left, const std::set<Index>& input_corners) {
  std::map<Index, int> ends;
  for (const FeatureCurve& curve : left.graph.curves)
    if (!curve.closed)
      for (const Index v : {curve.vertices.front(), curve.vertices.back()}) ++ends[v];
  int loose = 0;
  for (const auto& [v, count] : ends) loose += count == 1 && !input_corners.contains(v);
  return loose;
}

// Half of the lighter crease runs beside the heavier: the other half stays, and ends on the heavier.
TEST(SimplifiedFeatures, GoWhereTheyRunBesideOthers) {
  for (const bool turned : {false, true}) {
    CreasesOnAGrid grid;
    grid.crease({{0, 0}, {80, 0}}, 10);
    if (turned) grid.crease({{40, 40}, {40, 1}, {0, 1}}, 1);
    else grid.crease({{0, 1}, {40, 1}, {40, 40}}, 1);
    const SimplifiedFeatures left = grid.at_width(0.5);
    EXPECT_EQ(left.graph.curves.size(), 3u);
    EXPECT_NEAR(grid.length(left.graph), 8 + 4, 0.6);
    EXPECT_EQ(count_loose_ends(left, {}), 3);
    EXPECT_EQ(left.merged, 0u);
  }
}

// The nearer two creases are, the shorter are the stretches that go: less than a width where they are a fifth apart.
TEST(SimplifiedFeatures, GoForShorterStretchesWhereTheyAreNearer) {
  for (const int apart : {2, 4}) {
    CreasesOnAGrid grid;
    grid.crease({{0, 0}, {80, 0}}, 10);
    grid.crease({{0, 0}, {0, apart}, {7, apart}, {7, 40}}, 1);
    const SimplifiedFeatures left = grid.at_width(1);
    const bool stays = apart == 4;
    EXPECT_NEAR(grid.length(left.graph), 8 + 0.1 * (40 - apart) + (stays ? 0.7 + 0.1 * apart : 0), 0.35);
    EXPECT_EQ(count_loose_ends(left, {}), stays ? 2 : 3);
  }
}

// Two creases leave a corner at less than two degrees for less than what goes by itself: one ends where they part.
TEST(SimplifiedFeatures, PartWhereTheyNoLongerRunTogether) {
  for (const bool swapped : {false, true}) {
    Chains net;
    const Index corner = net.corner({0, 0, 0}), far = net.corner({12, 0, 0}), up = net.corner({2, 14, 0});
    net.points.insert(net.points.end(), {{2, 0, 0}, {2, 0.05, 0}});
    const Index on = up + 1, beside = up + 2;
    net.graph.curves = {{{corner, on, far}, false, FeatureKind::crease},
                        {{up, beside, corner}, false, FeatureKind::crease}};
    net.graph.edges = edges_of(net.graph.curves);
    const Csr<Index> neighbours = vertex_neighbours({{corner, on, beside}, {on, far, up}, {on, up, beside}}, 5);
    const std::vector<double> weights = swapped ? std::vector<double>{1, 2} : std::vector<double>{2, 1};
    const SimplifiedFeatures left = simplify_features(net.graph, net.points, weights, 3, {}, neighbours);
    EXPECT_EQ(left.graph.curves.size(), 3u);
    EXPECT_EQ(left.graph.edges.size(), 4u);  // one of those at the corner is gone, and one joins the two curves
    const auto has = [&](Index a, Index b) {
      return std::binary_search(left.graph.edges.begin(), left.graph.edges.end(), sorted_edge(a, b));
    };
    EXPECT_TRUE(has(on, beside));
    EXPECT_NE(has(corner, on), has(corner, beside));
  }
}

// An edge between the ends of a half circle is as near to it as can be at both ends, and nowhere between.
TEST(SimplifiedFeatures, BetweenTheSameCornersStayWhereTheyAreApart) {
  Chains net;
  const Index from = net.corner({2, 0, 0}), to = net.corner({-2, 0, 0});
  std::vector<Index> arc{from};
  std::vector<Triangle> triangles;
  for (int k = 1; k < 16; ++k) {
    const double angle = k * std::numbers::pi / 16;
    arc.push_back(static_cast<Index>(net.points.size()));
    net.points.push_back({2 * std::cos(angle), 2 * std::sin(angle), 0});
  }
  arc.push_back(to);
  for (std::size_t k = 1; k + 1 < arc.size(); ++k) triangles.push_back({arc[k], arc[k + 1], from});
  for (const bool edge_first : {false, true}) {
    net.graph.curves = {{arc, false, FeatureKind::crease}, {{from, to}, false, FeatureKind::crease}};
    if (edge_first) std::swap(net.graph.curves[0], net.graph.curves[1]);
    net.graph.edges = edges_of(net.graph.curves);
    const Csr<Index> neighbours = vertex_neighbours(triangles, net.points.size());
    for (const double width : {0.5, 1.0}) {
      const SimplifiedFeatures left = simplify_features(net.graph, net.points, {1, 1}, width, {}, neighbours);
      EXPECT_EQ(left.graph.edges, net.graph.edges);
    }
  }
}

// A crease along both sides of a strip and around a field at its end becomes one line to a loop.
TEST(SimplifiedFeatures, GoWhereTheyRunBesideThemselves) {
  CreasesOnAGrid grid;
  grid.crease({{0, 0}, {40, 0}, {40, -15}, {75, -15}, {75, 15}, {40, 15}, {40, 1}, {0, 1}}, 10);
  const SimplifiedFeatures left = grid.at_width(0.5);
  EXPECT_NEAR(grid.length(left.graph), 4 + 13, 0.6);
  EXPECT_EQ(count_loose_ends(left, {}), 1);
}

// Of a crease that goes back and forth, lines that are apart remain.
TEST(SimplifiedFeatures, OfAWindingCreaseAreLinesApart) {
  CreasesOnAGrid grid;
  std::vector<std::array<int, 2>> stations;
  for (int row = 0; row <= 20; ++row)
    for (const int x : {10, 70}) stations.push_back({row % 2 == 0 ? x : 80 - x, row});
  grid.crease(stations, 10);
  const double before = 21 * 6 + 2, after = grid.length(grid.at_width(0.5).graph);
  EXPECT_LT(after, 0.35 * before);
  EXPECT_GT(after, 0.1 * before);
}

// Of two creases that leave a corner at an acute angle the lighter begins where there is room between them.
TEST(SimplifiedFeatures, OfAnAcuteWedgeBeginWhereItIsWide) {
  constexpr Index kCount = 40;
  const double step = 0.05, width = 0.1;
  for (const double angle : {0.25, 0.4, 0.8}) {
    std::vector<Vec3> points{{0, 0, 0}};
    FeatureGraph graph;
    graph.curves.assign(2, {{0}, false, FeatureKind::crease});
    std::vector<Triangle> triangles;
    for (Index k = 1; k <= kCount; ++k) {
      const Index low = 2 * k - 1, high = 2 * k;
      points.push_back({step * k, 0, 0});
      points.push_back({step * k * std::cos(angle), step * k * std::sin(angle), 0});
      graph.curves[0].vertices.push_back(low);
      graph.curves[1].vertices.push_back(high);
      if (k == 1) {
        triangles.push_back({0, low, high});
      } else {
        triangles.push_back({low - 2, low, high});
        triangles.push_back({low - 2, high, high - 2});
      }
    }
    graph.corners = {0, 2 * kCount - 1, 2 * kCount};
    graph.edges = edges_of(graph.curves);
    const SimplifiedFeatures left =
        simplify_features(graph, points, {2, 1}, width, {}, vertex_neighbours(triangles, points.size()));
    const auto stays = [&](Index a, Index b) {
      return std::binary_search(left.graph.edges.begin(), left.graph.edges.end(), std::array<Index, 2>{a, b});
    };
    for (Index k = 2; k <= kCount; ++k) {
      EXPECT_TRUE(stays(2 * k - 3, 2 * k - 1)) << k;
      const double gap = step * k * std::sin(angle);
      if (angle > 0.5 || gap > 1.5 * width || gap < 0.7 * width) {
        EXPECT_EQ(stays(2 * k - 2, 2 * k), angle > 0.5 || gap > width) << angle << " " << k;
      }
    }
    EXPECT_EQ(count_loose_ends(left, {0, 2 * kCount - 1, 2 * kCount}), 0);
  }
}

}  // namespace
}  // namespace bisector::test
