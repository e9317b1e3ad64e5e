// Edges across wedges: the surface stays as it is, and curves can be parted that could not be before.
#include "features/wedges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "bisector/features.h"
#include "bisector/quality.h"
#include "core/degenerate.h"
#include "features/curves.h"
#include "features/simplify.h"
#include "mesh/topology.h"
#include "support/featured.h"

namespace bisector::test {
namespace {

double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles)
    area += triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  return area;
}

// A wedge with straight edges, and what linking makes of it and its features.
struct Linked {
  TriangleMesh before, mesh;
  FeatureGraph graph_before, graph;
  std::vector<EdgePoint> added;

  Linked(TriangleMesh given, double edge_length)
      : before(std::move(given)), mesh(before), graph_before(sharp_graph(before)) {
    added = link_wedges(mesh, graph_before, std::vector<double>(before.vertices.size(), edge_length));
    graph = split_features(graph_before, splits_of(added, before.vertices.size()));
  }
};

TEST(Wedges, AreLinkedOnTheSurface) {
  for (const double angle : {0.03, 0.1, 0.18}) {
    SCOPED_TRACE(angle);
    TriangleMesh solid = wedge(angle);
    for (std::size_t t = 0; t < solid.triangles.size(); ++t) solid.labels.push_back(static_cast<std::int32_t>(t));
    const Linked linked(solid, 0.1);
    ASSERT_FALSE(linked.added.empty());
    ASSERT_EQ(linked.mesh.vertices.size(), solid.vertices.size() + linked.added.size());
    for (std::size_t k = 0; k < linked.added.size(); ++k) {
      const auto& [a, b, t] = linked.added[k];
      const Vec3 &p = linked.mesh.vertices[a], &q = linked.mesh.vertices[b];
      EXPECT_EQ(linked.mesh.vertices[solid.vertices.size() + k], p + t * (q - p));
    }
    EXPECT_NEAR(area_of(linked.mesh), area_of(solid), 1e-12);
    const MeshTopology topology = analyse_topology(linked.mesh.triangles, linked.mesh.vertices.size());
    EXPECT_TRUE(topology.manifold && topology.closed && topology.oriented);
    EXPECT_EQ(topology.euler, 2);
    // Triangles lie in those that they are parts of.
    for (std::size_t t = 0; t < linked.mesh.triangles.size(); ++t) {
      ASSERT_EQ(linked.mesh.face_of_triangle[t], static_cast<Index>(linked.mesh.labels[t]));
      const Triangle& whole = solid.triangles[linked.mesh.face_of_triangle[t]];
      const Vec3 normal =
          unit(twice_area_normal(solid.vertices[whole[0]], solid.vertices[whole[1]], solid.vertices[whole[2]]));
      for (const Index v : linked.mesh.triangles[t])
        EXPECT_NEAR(dot(normal, linked.mesh.vertices[v] - solid.vertices[whole[0]]), 0, 1e-14);
    }
    // Features are the same lines, along edges of the mesh.
    const FeatureCurves before(linked.graph_before, solid.vertices), after(linked.graph, linked.mesh.vertices);
    ASSERT_EQ(after.size(), before.size());
    for (Index c = 0; c < after.size(); ++c) EXPECT_NEAR(after.length(c), before.length(c), 1e-14);
    const EdgeTable table = edge_table(linked.mesh.triangles, linked.mesh.vertices.size());
    for (const std::array<Index, 2>& edge : linked.graph.edges)
      EXPECT_TRUE(std::binary_search(table.edges.begin(), table.edges.end(), edge));
  }
}

TEST(Wedges, ThatAreWideAreNotLinked) {
  for (const double angle : {0.25, 0.6, 1.5}) EXPECT_TRUE(Linked(wedge(angle), 0.1).added.empty()) << angle;
  EXPECT_TRUE(Linked(box(1), 0.1).added.empty());
  EXPECT_TRUE(Linked(icosphere(2), 0.1).added.empty());
}

// Of the two edges that leave the tip, one begins where they are about the width apart.
TEST(Wedges, LetOneCurveBeginWhereThereIsRoom) {
  for (const double angle : {0.05, 0.1, 0.15}) {
    const double width = 0.02;
    const Linked linked(wedge(angle), 4 * width);
    const auto simplified = [&](const TriangleMesh& mesh, const FeatureGraph& graph) {
      return simplify_features(graph, mesh.vertices, curve_weights(graph, mesh.triangles, mesh.vertices), width, {},
                               vertex_neighbours(mesh.triangles, mesh.vertices.size()));
    };
    // Edges at most so narrow that run along the wedge, in the planes of its ends.
    const auto narrow_length = [&](const TriangleMesh& mesh, const FeatureGraph& graph) {
      double length = 0;
      for (const auto& [a, b] : graph.edges) {
        const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b];
        if (p.z != q.z) continue;
        const double from = std::min(norm(Vec3{p.x, p.y, 0}), norm(Vec3{q.x, q.y, 0}));
        const double to = std::min(std::max(norm(Vec3{p.x, p.y, 0}), norm(Vec3{q.x, q.y, 0})), 0.5 * width / angle);
        length += std::max(0.0, to - from);
      }
      return length;
    };
    const double both = 4 * 0.5 * width / angle;
    EXPECT_NEAR(narrow_length(linked.before, simplified(linked.before, linked.graph_before).graph), both, 0.01 * both);
    EXPECT_NEAR(narrow_length(linked.mesh, simplified(linked.mesh, linked.graph).graph), 0.5 * both, 0.01 * both)
        << angle;
  }
}

}  // namespace
}  // namespace bisector::test
