// Components that cross have the same vertices and edges along the curves in which they do.
#include "remesh/intersection_curves.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "core/geometry.h"
#include "features/curves.h"
#include "features/edge_splits.h"
#include "features/size_field.h"
#include "mesh/corefine.h"
#include "mesh/edge_splitter.h"
#include "mesh/topology.h"
#include "remesh/flip_crossings.h"
#include "remesh/kept.h"
#include "remesh/prepare.h"
#include "remesh/sizing.h"
#include "remesh/topology_control.h"
#include "support/featured.h"
#include "support/models.h"

namespace bisector::test {
namespace {

TriangleMesh moved(TriangleMesh mesh, const Vec3& scale, const Vec3& by) {
  for (Vec3& p : mesh.vertices) p = Vec3{p.x * scale.x, p.y * scale.y, p.z * scale.z} + by;
  return mesh;
}

TriangleMesh with_pin(const TriangleMesh& mesh, const Vec3& at) {
  return joined(mesh, moved(cylinder(24), {0.4, 0.4, 1.2}, at));
}

TriangleMesh pin_in_a_plate() { return with_pin(moved(box(1), {2, 2, 0.4}, {-1, -1, 0}), {0.1, -0.05, -0.3}); }

SizedMesh uniform(const TriangleMesh& mesh, double length) {
  SizedMesh sized;
  sized.mesh = mesh;
  sized.sizing.unit_edge = length;
  return sized;
}

TEST(IntersectionCurves, AreDividedAlikeOnBothComponents) {
  const auto cut = corefine_components(pin_in_a_plate(), 10'000);
  ASSERT_TRUE(cut.has_value());
  TriangleMesh mesh = cut->mesh;
  FeatureGraph features = detect_features(mesh, {});
  IntersectionCurves curves(*cut, {}, features);
  ASSERT_EQ(curves.size(), 2u);
  // Edges along a curve that have been divided on one component only.
  const FeatureCurve first = *std::find_if(features.curves.begin(), features.curves.end(),
                                           [](const FeatureCurve& c) { return c.kind == FeatureKind::intersection; });
  std::vector<EdgePoint> early;
  for (std::size_t k = 1; k < first.vertices.size(); ++k)
    early.push_back({first.vertices[k - 1], first.vertices[k], 0.37});
  const EdgeSplits splits = splits_of(early, mesh.vertices.size());
  EdgeSplitter splitter(mesh);
  for (const auto& [a, b, t] : early) splitter.split(a, b, t);
  curves.follow(splits);
  features = split_features(features, splits);
  const double wanted = 0.07;
  const auto division = curves.divide(mesh, features, uniform(mesh, wanted));
  EXPECT_TRUE(division.crowded.empty());
  for (const double length : division.lengths) EXPECT_NEAR(length, wanted, 0.2 * wanted);
  const std::vector<char> whole = curves.among(features);
  std::map<std::array<double, 6>, int> ends;  // of the edges that are to be
  for (std::size_t c = 0; c < whole.size(); ++c) {
    if (!whole[c]) continue;
    Vec3 a = mesh.vertices[features.curves[c].vertices.front()], b = mesh.vertices[features.curves[c].vertices.back()];
    std::array<double, 3> p{a.x, a.y, a.z}, q{b.x, b.y, b.z};
    if (q < p) std::swap(p, q);
    ++ends[{p[0], p[1], p[2], q[0], q[1], q[2]}];
  }
  EXPECT_EQ(ends.size(), division.lengths.size());
  for (const auto& [edge, count] : ends) EXPECT_EQ(count, 2);
  EXPECT_TRUE(same_topology(analyse_topology(mesh.triangles, mesh.vertices.size()),
                            analyse_topology(cut->mesh.triangles, cut->mesh.vertices.size())));
}

// A wall stands in a plate. What is wanted in the middle of its long sides, vertices at their ends do not know.
TEST(IntersectionCurves, AreDividedByTheSizesAlongThem) {
  const TriangleMesh wall = moved(box(1), {1.6, 0.2, 1.2}, {-0.8, -0.1, -0.4});
  const auto cut = corefine_components(joined(moved(box(1), {2, 2, 0.4}, {-1, -1, 0}), wall), 10'000);
  ASSERT_TRUE(cut.has_value());
  TriangleMesh mesh = cut->mesh;
  FeatureGraph features = detect_features(mesh, {});
  IntersectionCurves curves(*cut, {}, features);
  const double least = 0.03, gradation = 0.3, plain = 0.2;
  const std::vector<Vec3> points{{0.11, -0.1, 0.4}, {0.11, 0.1, 0.4}, {0.11, -0.1, 0}, {0.11, 0.1, 0}};
  const SizeField field(points, std::vector<double>(4, least), gradation);
  const auto division = curves.divide(mesh, features, refine_for_density(mesh, {}, {0, plain}, {&field, nullptr}));
  ASSERT_GT(division.lengths.size(), 40u);
  for (std::size_t k = 0; k < division.lengths.size(); ++k) {
    const double bound = field(division.middles[k]);
    // Short sides are as long as they are.
    if (std::abs(division.middles[k].x) > 0.79) continue;
    // The refined mesh has them within the fourth root of 2.5, and where 2.5 edges are wanted there are two.
    EXPECT_LT(division.lengths[k], 1.26 * 1.25 * bound);
    EXPECT_GT(division.lengths[k], 0.5 * std::min(bound, plain));
  }
}

// A vertex in the middle of what is to be an edge is taken out, and nothing else.
TEST(IntersectionCurves, LoseWhatDividesTheirEdges) {
  const TriangleMesh grid = grid_patch(6, 6);
  const auto at = [&](double x, double y) {
    return static_cast<Index>(std::find(grid.vertices.begin(), grid.vertices.end(), Vec3{x, y, 0}) -
                              grid.vertices.begin());
  };
  FeatureGraph features;
  features.curves = {{{at(2, 3), at(3, 3), at(4, 3)}, false, FeatureKind::intersection}};
  features.corners = {std::min(at(2, 3), at(4, 3)), std::max(at(2, 3), at(4, 3))};
  features.edges = edges_of(features.curves);
  RemeshResult result;
  result.mesh = grid;
  result.mesh.feature_edges = features.edges;
  result.places.resize(grid.vertices.size());
  for (Index k = 0; k < 2; ++k) result.places[features.corners[k]] = {SeedPlace::Kind::fixed, kNone, k, 0};
  result.places[at(3, 3)] = {SeedPlace::Kind::curve, 0, kNone, 1};
  result.input_topology = analyse_topology(grid.triangles, grid.vertices.size());
  const SizeBounds divided = make_curves_whole({1}, features, grid, result);
  ASSERT_EQ(divided.points.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(divided.points[k].y, 3);
    EXPECT_EQ(divided.lengths[k], 1);
  }
  EXPECT_TRUE(result.topology_matches);
  const std::vector<Vec3>& points = result.mesh.vertices;
  EXPECT_EQ(std::count(points.begin(), points.end(), Vec3{3, 3, 0}), 0);
  EXPECT_EQ(result.places.size(), points.size());
  ASSERT_EQ(result.mesh.feature_edges.size(), 1u);
  const auto [a, b] = result.mesh.feature_edges[0];
  EXPECT_EQ(norm(points[a] - points[b]), 2);
  const EdgeTable table = edge_table(result.mesh.triangles, points.size());
  EXPECT_TRUE(std::binary_search(table.edges.begin(), table.edges.end(), sorted_edge(a, b)));
  double area = 0;
  for (const Triangle& t : result.mesh.triangles)
    area += 0.5 * twice_area_normal(points[t[0]], points[t[1]], points[t[2]]).z;
  EXPECT_NEAR(std::abs(area), 36, 1e-9);
}

// Two pins stand so near to each other that edges of their circles come between.
TEST(IntersectionCurves, WithoutRoomAreLeftOut) {
  const auto cut = corefine_components(with_pin(pin_in_a_plate(), {0.905, -0.05, -0.3}), 10'000);
  ASSERT_TRUE(cut.has_value());
  const FeatureGraph features = detect_features(cut->mesh, {});
  const EdgeTable table = edge_table(cut->mesh.triangles, cut->mesh.vertices.size());
  std::vector<std::array<Index, 2>> left_out;
  std::size_t rounds = 0, edges = 0;
  for (bool has_room = false; !has_room; ++rounds) {
    ASSERT_LT(rounds, 10u);
    TriangleMesh mesh = cut->mesh;
    FeatureGraph with = features;
    IntersectionCurves curves(*cut, left_out, with);
    const auto division = curves.divide(mesh, with, uniform(mesh, 0.12));
    for (const auto& edge : division.crowded)
      EXPECT_TRUE(std::binary_search(table.edges.begin(), table.edges.end(), edge));
    left_out.insert(left_out.end(), division.crowded.begin(), division.crowded.end());
    has_room = division.crowded.empty();
    edges = division.lengths.size();
  }
  EXPECT_GT(rounds, 1u);
  EXPECT_GT(edges, 60u);
  // What lies between the pins is left out, and nothing on the far sides.
  for (const auto& edge : left_out) EXPECT_LT(std::abs(cut->mesh.vertices[edge[0]].x - 0.5025), 0.2);
}

TEST(IntersectionCurves, LeaveNoTrianglesThatCross) {
  const TriangleMesh input = pin_in_a_plate();
  RemeshOptions options;
  options.vertices = 900;
  std::vector<std::string> warnings;
  Context context;
  context.warning = [&](const std::string& line) { warnings.push_back(line); };
  const RemeshResult result = remesh(input, options, context);
  EXPECT_EQ(count_self_intersections(result.mesh), 0u);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_LE(result.mesh.vertices.size(), 909u);
  EXPECT_GE(measure_quality(result.mesh).theta_min, 30);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("components meet along 2 curves"), std::string::npos) << warnings[0];
  std::map<Index, std::size_t> ends;
  for (const auto& edge : find_common_parts(result.mesh).edges)
    for (const Index end : edge) ++ends[end];
  EXPECT_GE(ends.size(), 12u);
  for (const auto& [point, count] : ends) EXPECT_EQ(count, 2u);
}

// Values of vertices that components get where they are cut are those of the triangles there.
TEST(IntersectionCurves, CarryTheDensity) {
  const TriangleMesh input = pin_in_a_plate();
  RemeshOptions options;
  options.vertices = 900;
  options.sizing.kind = DensityKind::attribute;
  for (const Vec3& p : input.vertices) options.sizing.attribute.push_back(2 + p.x);
  Preparation preparation(OrderedInput(input, options), {});
  ASSERT_FALSE(preparation.intersections().empty());
  const PreparedInput prepared = preparation.lay_down();
  const Preparation apart = preparation.without_intersections();
  EXPECT_TRUE(apart.intersections().empty());
  EXPECT_EQ(count_self_intersections(apart.mesh()), count_self_intersections(input));
  EXPECT_EQ(count_self_intersections(preparation.mesh()), 0u);
  // Edges are shorter near the curves, but nowhere longer than the attribute asks for, by the input's own vertices.
  const auto share = [&](Index v) {
    return prepared.density[v] / (2 + preparation.apart().back(prepared.mesh.vertices[v]).x);
  };
  double least = share(0);
  for (Index v = 1; v < input.vertices.size(); ++v) least = std::min(least, share(v));
  for (Index v = 0; v < prepared.mesh.vertices.size(); ++v) EXPECT_GE(share(v), 0.999 * least);
}

// Two pyramids on a bent square, with the same two triangles in it.
TEST(FlipCrossings, PartsTrianglesThatBothComponentsHave) {
  TriangleMesh mesh;
  mesh.vertices = {{1, 0, 0.1}, {0, 1, -0.1}, {-1, 0, 0.1}, {0, -1, -0.1}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {0, 2, 1}, {0, 3, 2}};
  TriangleMesh below = mesh;
  below.vertices[4].z = -1;
  for (Triangle& t : below.triangles) std::swap(t[0], t[1]);
  mesh = joined(std::move(mesh), below);
  for (const Index first : {0u, 5u})
    for (const auto& [a, b] : {std::array<Index, 2>{0, 1}, {1, 2}, {2, 3}, {0, 3}})
      mesh.feature_edges.push_back({first + a, first + b});
  ASSERT_EQ(count_self_intersections(mesh), 2u);
  const MeshTopology before = analyse_topology(mesh.triangles, mesh.vertices.size());
  flip_where_components_cross(mesh);
  EXPECT_EQ(count_self_intersections(mesh), 0u);
  EXPECT_TRUE(same_topology(analyse_topology(mesh.triangles, mesh.vertices.size()), before));
  EXPECT_TRUE(analyse_topology(mesh.triangles, mesh.vertices.size()).oriented);
}

}  // namespace
}  // namespace bisector::test
