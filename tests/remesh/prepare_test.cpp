// What is done to an input before seeds are placed: cracks that rounding made, and solids that touch.
#include "remesh/prepare.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "bisector/repair.h"
#include "support/divided_vertex.h"
#include "support/models.h"

namespace bisector::test {
namespace {

// With values at all vertices, which have to follow what is done to these.
RemeshOptions with_density(const TriangleMesh& mesh) {
  RemeshOptions options;
  options.vertices = 600;
  options.sizing.kind = DensityKind::attribute;
  options.sizing.attribute.assign(mesh.vertices.size(), 1.0);
  return options;
}

Context collecting(std::vector<std::string>& warnings) {
  Context context;
  context.warning = [&](const std::string& line) { warnings.push_back(line); };
  return context;
}

TEST(JoinBorders, ClosesWhatRoundingOpens) {
  const TriangleMesh sphere = icosphere(3);
  for (const double size : {0.0, 5e-8, 5e-7, 5e-6}) {
    SCOPED_TRACE(size);
    const WeldResult joined = join_borders(torn(sphere, size), {});
    EXPECT_EQ(joined.border_after, 0u);
    EXPECT_EQ(joined.mesh.vertices.size(), sphere.vertices.size());
    EXPECT_EQ(joined.mesh.triangles.size(), sphere.triangles.size());
  }
  EXPECT_GT(join_borders(torn(sphere, 1e-3), {}).border_after, 1000u);
}

// As programs write faces that have normals or texture coordinates of their own.
TEST(JoinBorders, JoinsFacesWhereThreeAndMoreMeet) {
  const TriangleMesh boxes = weld(joined(box(4), box(4), {1, 1, 0}), 0).mesh;
  ASSERT_EQ(topology_of(boxes).non_manifold_edges, 4u);
  const WeldResult joined = join_borders(torn(boxes, 0), {});
  EXPECT_EQ(joined.border_after, 0u);
  EXPECT_EQ(joined.mesh.vertices.size(), boxes.vertices.size());
  EXPECT_EQ(topology_of(joined.mesh).non_manifold_edges, 4u);
}

// Nothing is gained where a closed box stands on a box that is open elsewhere: what both share stays apart.
TEST(JoinBorders, KeepsApartWhatHasNoBorderThere) {
  TriangleMesh boxes = joined(box(4), box(4), {1, 1, 0});
  boxes.triangles.erase(boxes.triangles.begin());
  const WeldResult joined = join_borders(boxes, {});
  EXPECT_EQ(joined.merged_vertices, 0u);
  EXPECT_EQ(joined.mesh.triangles, boxes.triangles);
}

// Sides of a sheet with a label each, in any order.
TEST(JoinBorders, TakesDoubleTrianglesOnceWithTheLowerLabel) {
  const TriangleMesh sheet = wavy_patch(6);
  TriangleMesh both;
  both.vertices = sheet.vertices;
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    const auto [a, b, c] = sheet.triangles[t];
    const std::array<std::pair<Triangle, std::int32_t>, 2> sides{{{{a, b, c}, 3}, {{c, b, a}, 7}}};
    for (const std::size_t side : {t % 2, 1 - t % 2}) {
      both.triangles.push_back(sides[side].first);
      both.labels.push_back(sides[side].second);
    }
  }
  const WeldResult joined = join_borders(both, {});
  EXPECT_EQ(joined.mesh.triangles, sheet.triangles);
  EXPECT_EQ(joined.mesh.labels, std::vector<std::int32_t>(sheet.triangles.size(), 3));
  EXPECT_EQ(joined.duplicate_triangles, sheet.triangles.size());
}

TEST(JoinBorders, MovesNothingOfAClosedSurface) {
  TriangleMesh sphere = icosphere(3);
  for (Vec3& p : sphere.vertices) p.z *= 1e-6;
  const WeldResult joined = join_borders(sphere, {});
  EXPECT_EQ(joined.merged_vertices, 0u);
  EXPECT_EQ(joined.mesh.triangles, sphere.triangles);
}

// Two boxes over one edge, with the same vertices there.
TEST(Preparation, SolidsThatTouchAlongAnEdgeAreMeshedApart) {
  const TriangleMesh boxes = weld(joined(box(4), box(4), {1, 1, 0}), 0).mesh;
  ASSERT_EQ(topology_of(boxes).non_manifold_edges, 4u);
  std::vector<std::string> warnings;
  const Context context = collecting(warnings);
  const RemeshResult result = remesh(boxes, with_density(boxes), context);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_TRUE(result.topology.manifold);
  EXPECT_EQ(result.topology.components, 2u);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_GT(measure_quality(result.mesh).theta_min, 30);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("along 4 edges"), std::string::npos) << warnings[0];
}

// A box with corners that rounding made two.
TEST(Preparation, CornersThatRoundingMadeTwoAreOne) {
  TriangleMesh mesh = box(1);
  const std::size_t vertices = mesh.vertices.size();
  for (const Index v : {0u, 3u, 6u}) divide_vertex(mesh, v, 1, 2, {1e-14, 0, 0});
  RemeshOptions options = with_density(mesh);
  std::vector<std::string> warnings;
  const Context context = collecting(warnings);
  const Preparation preparation(OrderedInput(mesh, options), context);
  EXPECT_EQ(preparation.mesh().vertices.size(), vertices);
  ASSERT_EQ(preparation.welded().vertex_of.size(), mesh.vertices.size());
  for (const Index v : preparation.welded().vertex_of) EXPECT_LT(v, vertices);
  EXPECT_EQ(preparation.welded().merged_vertices, 3u);
  EXPECT_EQ(preparation.welded().degenerate_triangles, 6u);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("collapsed 3 edges"), std::string::npos) << warnings[0];
  const RemeshResult result = remesh(mesh, options);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.features.corners, 8u);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_GT(measure_quality(result.mesh).theta_min, 30);
  // With a tolerance of its own, and around what is kept, the surface stays as it is.
  options.weld = 0;
  EXPECT_EQ(Preparation(OrderedInput(mesh, options), {}).mesh().vertices.size(), mesh.vertices.size());
  options.weld.reset();
  options.keep_vertices = {1};
  EXPECT_EQ(Preparation(OrderedInput(mesh, options), {}).mesh().vertices.size(), mesh.vertices.size());
}

// Closed parts smaller than rounding are left out, with what is given at their vertices.
TEST(Preparation, DensitiesOfPartsThatAreLeftOutGoWithThem) {
  TriangleMesh speck = icosphere(0);
  for (Vec3& p : speck.vertices) p = 1e-7 * p;
  const TriangleMesh mesh = joined(icosphere(3), speck, {0.1, 0.2, 0.3});
  RemeshOptions options;
  options.vertices = 600;
  options.sizing.kind = DensityKind::attribute;
  options.sizing.attribute.assign(mesh.vertices.size(), 1);
  Preparation preparation(OrderedInput(mesh, options), {});
  EXPECT_EQ(preparation.mesh().triangles.size(), icosphere(3).triangles.size());
  const std::vector<double> density = preparation.lay_down().density;
  for (const double rho : density) EXPECT_NEAR(rho, density[0], 1e-9 * density[0]);
}

// Bounds of edge lengths that are found where components are set apart hold there, not where nothing is in the input.
TEST(Preparation, BoundsFollowWhatIsSetApart) {
  RemeshOptions options;
  options.vertices = 600;
  Preparation preparation(OrderedInput(joined(icosphere(4), icosphere(4), {0.8, 0.3, 0.1}), options), {});
  ASSERT_FALSE(preparation.apart().empty());
  const TriangleMesh apart = preparation.lay_down().mesh;
  Vec3 at;
  for (const Vec3& p : apart.vertices)
    if (norm(p - preparation.apart().back(p)) > 1) at = p;
  ASSERT_GT(norm(at), 1);
  preparation.bound({{at}, {0.02}});
  const PreparedInput prepared = preparation.lay_down();
  const auto densest = std::max_element(prepared.density.begin(), prepared.density.end());
  ASSERT_NE(densest, prepared.density.end());
  EXPECT_GT(*densest, 100 * *std::min_element(prepared.density.begin(), prepared.density.end()));
  const Vec3& there = prepared.mesh.vertices[static_cast<std::size_t>(densest - prepared.density.begin())];
  EXPECT_LT(norm(preparation.apart().back(there) - preparation.apart().back(at)), 0.02);
}

// A cell of next to no area asks for edges of next to no length, which would take as many facets as there may be.
TEST(Preparation, BoundsAreNoShorterThanRounding) {
  RemeshOptions options;
  options.vertices = 600;
  const TriangleMesh sphere = icosphere(3);
  Preparation preparation(OrderedInput(sphere, options), {});
  preparation.bound({{sphere.vertices[0]}, {1e-30}});
  const PreparedInput prepared = preparation.lay_down();
  EXPECT_LT(prepared.mesh.triangles.size(), 20 * sphere.triangles.size());
  const double highest = *std::max_element(prepared.density.begin(), prepared.density.end());
  EXPECT_NEAR(prepared.unit_edge / std::pow(highest, 0.25), 1e-5 * bounding_box(sphere).diagonal(), 1e-8);
}

}  // namespace
}  // namespace bisector::test
