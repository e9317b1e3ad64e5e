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
#include "mesh/corefine.h"
#include "mesh/topology.h"
#include "remesh/flip_crossings.h"
#include "remesh/topology_control.h"
#include "support/featured.h"
#include "support/models.h"

namespace bisector::test {
namespace {

TriangleMesh moved(TriangleMesh mesh, const Vec3& scale, const Vec3& by) {
  for (Vec3& p : mesh.vertices) p = Vec3{p.x * scale.x, p.y * scale.y, p.z * scale.z} + by;
  return mesh;
}

// A pin in a plate, and a ball on it.
TriangleMesh pin_in_a_plate() {
  const TriangleMesh plate = moved(box(1), {2, 2, 0.4}, {-1, -1, 0});
  return joined(plate, moved(cylinder(24), {0.4, 0.4, 1.2}, {0.1, -0.05, -0.3}));
}

TEST(IntersectionCurves, AreDividedAlikeOnBothComponents) {
  const auto cut = corefine_components(pin_in_a_plate(), 10'000);
  ASSERT_TRUE(cut.has_value());
  TriangleMesh mesh = cut->mesh;
  FeatureGraph features = detect_features(mesh, {});
  IntersectionCurves curves(*cut, {}, features);
  ASSERT_EQ(curves.size(), 2u);
  const double wanted = 0.1;
  const auto division = curves.divide(mesh, features, std::vector<double>(mesh.vertices.size(), wanted));
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

TEST(IntersectionCurves, WithoutRoomAreLeftOut) {
  const auto cut = corefine_components(pin_in_a_plate(), 10'000);
  ASSERT_TRUE(cut.has_value());
  FeatureGraph features = detect_features(cut->mesh, {});
  TriangleMesh mesh = cut->mesh;
  FeatureGraph with = features;
  IntersectionCurves curves(*cut, {}, with);
  // The circles are three edges each then, and bulge out of them.
  const auto division = curves.divide(mesh, with, std::vector<double>(mesh.vertices.size(), 100.0));
  for (const auto& edge : division.crowded) {
    const EdgeTable table = edge_table(cut->mesh.triangles, cut->mesh.vertices.size());
    EXPECT_TRUE(std::binary_search(table.edges.begin(), table.edges.end(), edge));
  }
  std::vector<std::array<Index, 2>> all;
  const CommonParts common = find_common_parts(cut->mesh);
  for (const Triangle& t : cut->mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = t[k], b = t[(k + 1) % 3];
      if (common.same[a] != kNone && common.same[b] != kNone) all.push_back(sorted_edge(a, b));
    }
  const std::size_t before = features.curves.size();
  EXPECT_TRUE(IntersectionCurves(*cut, all, features).empty());
  EXPECT_EQ(features.curves.size(), before);
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
