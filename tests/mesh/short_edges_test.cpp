// Edges that are shorter than rounding: what a surface without them is, and what has to stay.
#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <vector>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/random.h"
#include "mesh/short_edges.h"
#include "remesh/topology_control.h"
#include "support/divided_vertex.h"
#include "support/models.h"

namespace bisector::test {
namespace {

constexpr double kTiny = 1e-9, kShort = 1e-6;

TEST(ShortEdges, OfDividedVerticesAreCollapsed) {
  Random random(3);
  for (TriangleMesh mesh : {icosphere(2), torus(12, 8), box(4)}) {
    const TriangleMesh before = mesh;
    const auto vertices = static_cast<Index>(before.vertices.size());
    const std::size_t divided = 40;
    std::vector<Index> origin(vertices);
    for (Index v = 0; v < vertices; ++v) origin[v] = v;
    for (std::size_t k = 0; k < divided; ++k) {
      const auto v = static_cast<Index>(random.uniform() * static_cast<double>(mesh.vertices.size()));
      const Vec3 offset = kTiny * Vec3{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5};
      divide_vertex(mesh, v, static_cast<std::size_t>(3 * random.uniform()), 1 + k % 2, offset);
      origin.push_back(Index{origin[v]});
    }
    ASSERT_TRUE(same_topology(topology_of(mesh), topology_of(before)));
    const ShortEdges result = collapse_short_edges(mesh, kShort, {});
    EXPECT_EQ(result.collapsed, divided);
    EXPECT_EQ(result.removed_triangles, 2 * divided);
    EXPECT_EQ(mesh.vertices.size(), before.vertices.size());
    EXPECT_EQ(mesh.triangles.size(), before.triangles.size());
    EXPECT_EQ(mesh.face_of_triangle.size(), mesh.triangles.size());
    EXPECT_TRUE(same_topology(topology_of(mesh), topology_of(before)));
    ASSERT_EQ(result.vertex_of.size(), origin.size());
    for (Index v = 0; v < origin.size(); ++v) {
      EXPECT_EQ(result.vertex_of[v], result.vertex_of[origin[v]]);
      EXPECT_LT(norm(mesh.vertices[result.vertex_of[v]] - before.vertices[origin[v]]), 1e-7);
    }
  }
}

TEST(ShortEdges, LongerOnesStay) {
  TriangleMesh mesh = icosphere(2);
  const TriangleMesh before = mesh;
  const ShortEdges result = collapse_short_edges(mesh, kShort, {});
  EXPECT_EQ(result.collapsed, 0u);
  EXPECT_EQ(mesh.vertices, before.vertices);
  EXPECT_EQ(mesh.triangles, before.triangles);
  EXPECT_TRUE(mesh.face_of_triangle.empty());
  for (Index v = 0; v < result.vertex_of.size(); ++v) EXPECT_EQ(result.vertex_of[v], v);
}

// Rings of points around the z axis, each joined to the next one.
TriangleMesh tube(const std::vector<double>& radii, Index around) {
  TriangleMesh mesh;
  for (std::size_t ring = 0; ring < radii.size(); ++ring)
    for (Index k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around;
      mesh.vertices.push_back({radii[ring] * std::cos(angle), radii[ring] * std::sin(angle), double(ring)});
    }
  for (Index ring = 0; ring + 1 < radii.size(); ++ring)
    for (Index k = 0; k < around; ++k) {
      const Index a = ring * around + k, b = ring * around + (k + 1) % around;
      mesh.triangles.push_back({a, b, b + around});
      mesh.triangles.push_back({a, b + around, a + around});
    }
  return mesh;
}

TEST(ShortEdges, NeckStaysOpen) {
  for (const Index around : {3u, 4u, 7u}) {
    TriangleMesh mesh = tube({1, 1, kTiny, 1, 1}, around);
    const MeshTopology before = topology_of(mesh);
    const ShortEdges result = collapse_short_edges(mesh, kShort, {});
    EXPECT_EQ(result.collapsed, around - 3);  // a triangle is the least ring
    EXPECT_TRUE(same_topology(topology_of(mesh), before));
  }
}

TEST(ShortEdges, SmallPartStaysClosed) {
  TriangleMesh mesh = icosphere(2);
  for (Vec3& p : mesh.vertices) p *= kTiny;
  collapse_short_edges(mesh, kShort, {});
  EXPECT_EQ(mesh.triangles.size(), 4u);
  const MeshTopology topology = topology_of(mesh);
  EXPECT_TRUE(topology.closed && topology.manifold && topology.oriented);
  EXPECT_EQ(topology.euler, 2);
}

// Beside others it is a point but for rounding.
TEST(ShortEdges, SmallPartsGoBesideOthers) {
  TriangleMesh small = icosphere(2);
  for (Vec3& p : small.vertices) p *= kTiny;
  const TriangleMesh large = icosphere(2);
  TriangleMesh mesh = joined(small, large, {3, 0, 0});
  const ShortEdges result = collapse_short_edges(mesh, kShort, {});
  EXPECT_EQ(result.removed_parts, 1u);
  EXPECT_EQ(result.removed_triangles, small.triangles.size());
  EXPECT_EQ(mesh.triangles.size(), large.triangles.size());
  ASSERT_EQ(mesh.vertices.size(), large.vertices.size());
  for (Index v = 0; v < small.vertices.size(); ++v) EXPECT_EQ(result.vertex_of[v], kNone);
  for (Index v = 0; v < large.vertices.size(); ++v) EXPECT_EQ(result.vertex_of[small.vertices.size() + v], v);
  // A label's border is a line that nothing takes away, however short.
  mesh = joined(small, large, {3, 0, 0});
  mesh.labels.assign(mesh.triangles.size(), 0);
  mesh.labels[0] = 1;
  EXPECT_EQ(collapse_short_edges(mesh, kShort, {}).removed_parts, 0u);
}

// What is left of a fold has two sides and no inside.
TEST(ShortEdges, FlatPartsGoIfTheyAreSmallerThanEdges) {
  for (const double height : {0.1 * kShort, 100 * kShort})
    for (const double flat_part : {0.1, 10.0}) {
      TriangleMesh fold;
      fold.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, height}, {0, 1, 0}};
      fold.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 0, 3}, {1, 3, 2}};
      TriangleMesh mesh = joined(fold, icosphere(2), {5, 0, 0});
      const bool goes = height < kShort && flat_part > 1;
      EXPECT_EQ(collapse_short_edges(mesh, kShort, {}, flat_part).removed_parts, goes ? 1u : 0u);
      EXPECT_EQ(topology_of(mesh).components, goes ? 1u : 2u);
    }
}

// A strip narrower than rounding, in a square or alone.
TriangleMesh strip() {
  TriangleMesh mesh;
  for (Index k = 0; k < 5; ++k) mesh.vertices.insert(mesh.vertices.end(), {{double(k), 0, 0}, {double(k), kTiny, 0}});
  for (Index k = 0; k < 4; ++k) {
    const Index a = 2 * k;
    mesh.triangles.push_back({a, a + 2, a + 3});
    mesh.triangles.push_back({a, a + 3, a + 1});
  }
  return mesh;
}

TEST(ShortEdges, AcrossStripsBetweenBordersStay) {
  TriangleMesh mesh = strip();
  const MeshTopology before = topology_of(mesh);
  const ShortEdges result = collapse_short_edges(mesh, kShort, {});
  EXPECT_LE(result.collapsed, 2u);  // the edges at its ends
  EXPECT_TRUE(same_topology(topology_of(mesh), before));
}

TEST(ShortEdges, LinesStayApart) {
  // Three rows of squares, the middle one of no height.
  TriangleMesh mesh;
  const double heights[] = {0, 1, 1 + kTiny, 2};
  for (const double y : heights)
    for (int x = 0; x < 4; ++x) mesh.vertices.push_back({double(x), y, 0});
  std::vector<std::array<Index, 2>> rows;
  for (Index y = 0; y < 3; ++y)
    for (Index x = 0; x < 3; ++x) {
      const Index a = 4 * y + x;
      mesh.triangles.push_back({a, a + 1, a + 5});
      mesh.triangles.push_back({a, a + 5, a + 4});
      if (y > 0) rows.push_back({a, a + 1});
    }
  TriangleMesh plain = mesh, given = mesh, marked = mesh, labelled = mesh;
  marked.feature_edges = rows;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) labelled.labels.push_back(static_cast<int>(t) / 6);
  // Without lines the two rows become one.
  EXPECT_EQ(collapse_short_edges(plain, kShort, {}).collapsed, 4u);
  EXPECT_LE(collapse_short_edges(given, kShort, rows).collapsed, 2u);
  EXPECT_LE(collapse_short_edges(marked, kShort, {}).collapsed, 2u);
  EXPECT_LE(collapse_short_edges(labelled, kShort, {}).collapsed, 2u);
  for (const TriangleMesh* left : {&given, &marked, &labelled})
    EXPECT_TRUE(same_topology(topology_of(*left), topology_of(mesh)));
  EXPECT_EQ(marked.feature_edges.size(), rows.size());
  EXPECT_EQ(labelled.labels.size(), labelled.triangles.size());
}

TEST(ShortEdges, EndsOnLinesDoNotLeaveThem) {
  TriangleMesh mesh = grid_patch(4, 4);
  // An inner vertex as near to the border as rounding.
  Index corner = 0, inner = 0;
  for (Index v = 0; v < mesh.vertices.size(); ++v) {
    if (mesh.vertices[v] == Vec3{0, 2, 0}) corner = v;
    if (mesh.vertices[v] == Vec3{1, 2, 0}) inner = v;
  }
  mesh.vertices[inner] = {kTiny, 2, 0};
  const ShortEdges result = collapse_short_edges(mesh, kShort, {});
  EXPECT_EQ(result.collapsed, 1u);
  EXPECT_EQ(result.vertex_of[inner], result.vertex_of[corner]);
  EXPECT_EQ(mesh.vertices[result.vertex_of[corner]], (Vec3{0, 2, 0}));
}

}  // namespace
}  // namespace bisector::test
