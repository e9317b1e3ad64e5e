// Meshes without vertices that lie flat: the surface stays, and features do not depend on how finely it was divided.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "bisector/features.h"
#include "core/geometry.h"
#include "features/planar_reduction.h"
#include "mesh/topology.h"
#include "support/models.h"

namespace bisector::test {
namespace {

using Edge = std::array<Index, 2>;

Edge ascending(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

// Every triangle in four; new vertices follow the old ones.
TriangleMesh divided(const TriangleMesh& mesh) {
  TriangleMesh result;
  result.vertices = mesh.vertices;
  std::map<Edge, Index> middle;
  const auto between = [&](Index a, Index b) {
    const auto [at, fresh] = middle.try_emplace(ascending(a, b), static_cast<Index>(result.vertices.size()));
    if (fresh) result.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
    return at->second;
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    const Index ab = between(a, b), bc = between(b, c), ca = between(c, a);
    for (const Triangle& part : {Triangle{a, ab, ca}, Triangle{b, bc, ab}, Triangle{c, ca, bc}, Triangle{ab, bc, ca}}) {
      result.triangles.push_back(part);
      if (!mesh.labels.empty()) result.labels.push_back(mesh.labels[t]);
    }
  }
  for (const auto& [a, b] : mesh.feature_edges) {
    result.feature_edges.push_back({a, between(a, b)});
    result.feature_edges.push_back({between(a, b), b});
  }
  return result;
}

// A sphere as rough as a scan, with folds of more than 40 degrees that are no creases.
TriangleMesh rough_sphere() {
  TriangleMesh mesh = icosphere(4);
  SplitMix64 random(3);
  for (Vec3& p : mesh.vertices) p = (1 + 0.018 * random.range(-1, 1)) * p;
  return mesh;
}

TriangleMesh turned(TriangleMesh mesh) {
  for (Vec3& p : mesh.vertices)
    p = {0.6 * p.x - 0.48 * p.y + 0.64 * p.z, 0.8 * p.x + 0.36 * p.y - 0.48 * p.z, 0.8 * p.y + 0.6 * p.z};
  return mesh;
}

double area(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
  double sum = 0;
  for (const auto& [a, b, c] : triangles) sum += 0.5 * norm(twice_area_normal(points[a], points[b], points[c]));
  return sum;
}

std::vector<Edge> edges_of(const TriangleMesh& mesh) { return edge_table(mesh.triangles, mesh.vertices.size()).edges; }

std::size_t vertices_in(const std::vector<Triangle>& triangles) {
  std::set<Index> used;
  for (const Triangle& t : triangles) used.insert(t.begin(), t.end());
  return used.size();
}

TEST(PlanarReduction, LeavesTheSurfaceWhereItIs) {
  for (const TriangleMesh& coarse : {turned(box(4)), rough_sphere(), wavy_patch(9), pages(), torus(20, 9)}) {
    const TriangleMesh mesh = divided(divided(coarse));
    const PlanarReduction reduced(mesh.vertices, mesh.triangles, {}, {});
    const double diagonal = bounding_box(mesh.vertices).diagonal();
    EXPECT_NEAR(area(mesh.vertices, reduced.triangles), area(mesh.vertices, mesh.triangles),
                1e-6 * diagonal * diagonal);
    const MeshTopology before = analyse_topology(mesh.triangles, mesh.vertices.size());
    const MeshTopology after = analyse_topology(reduced.triangles, mesh.vertices.size());
    EXPECT_EQ(after.euler, before.euler);
    EXPECT_EQ(after.components, before.components);
    EXPECT_EQ(after.manifold, before.manifold);
    EXPECT_EQ(after.oriented, before.oriented);
    std::set<Index> used;
    for (const Triangle& t : reduced.triangles) used.insert(t.begin(), t.end());
    for (Index v = 0; v < mesh.vertices.size(); v += 7) {
      if (used.contains(v)) continue;
      double least = diagonal;
      for (const auto& [a, b, c] : reduced.triangles)
        least = std::min(least, norm(mesh.vertices[v] - nearest_on_triangle(mesh.vertices[v], mesh.vertices[a],
                                                                            mesh.vertices[b], mesh.vertices[c])));
      EXPECT_LT(least, 2e-6 * diagonal);
    }
  }
}

TEST(PlanarReduction, UndoesDivision) {
  for (const TriangleMesh& coarse : {rough_sphere(), icosphere(2), wavy_patch(9)}) {
    const TriangleMesh mesh = divided(divided(coarse));
    const PlanarReduction reduced(mesh.vertices, mesh.triangles, {}, {});
    std::set<std::array<Index, 3>> got, want;
    for (const auto& [list, into] : {std::pair{&reduced.triangles, &got}, std::pair{&coarse.triangles, &want}})
      for (Triangle t : *list) {
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        into->insert(t);
      }
    EXPECT_EQ(got, want);
  }
}

TEST(PlanarReduction, LeavesCornersOfACube) {
  const TriangleMesh mesh = turned(box(8));
  const PlanarReduction reduced(mesh.vertices, mesh.triangles, {}, {});
  EXPECT_EQ(vertices_in(reduced.triangles), 8u);
  EXPECT_EQ(reduced.triangles.size(), 12u);
}

TEST(PlanarReduction, LeavesRoughSurfacesAlone) {
  const TriangleMesh mesh = rough_sphere();
  const PlanarReduction reduced(mesh.vertices, mesh.triangles, {}, {});
  EXPECT_EQ(reduced.triangles, mesh.triangles);
}

TEST(PlanarReduction, KeepsLabelsAndGivenEdges) {
  TriangleMesh mesh = grid_patch(12, 12);
  std::vector<std::int32_t> labels;
  for (const auto& [a, b, c] : mesh.triangles)
    labels.push_back((mesh.vertices[a].x + mesh.vertices[b].x + mesh.vertices[c].x) / 3 < 5);
  const std::vector<Edge> kept{ascending(mesh.triangles[40][0], mesh.triangles[40][1])};
  const PlanarReduction reduced(mesh.vertices, mesh.triangles, labels, kept);
  EXPECT_LT(reduced.triangles.size(), 20u);
  double left = 0;
  bool has_edge = false;
  for (std::size_t t = 0; t < reduced.triangles.size(); ++t) {
    const Triangle& v = reduced.triangles[t];
    if (labels[reduced.origin[t]]) left += area(mesh.vertices, {v});
    for (int k = 0; k < 3; ++k) has_edge |= ascending(v[k], v[(k + 1) % 3]) == kept[0];
  }
  EXPECT_DOUBLE_EQ(left, 60);
  EXPECT_TRUE(has_edge);
}

TEST(PlanarReduction, ChainsLeadAlongEdgesOfTheMesh) {
  const TriangleMesh mesh = turned(box(8));
  const PlanarReduction reduced(mesh.vertices, mesh.triangles, {}, {});
  const std::vector<Edge> edges = edges_of(mesh);
  std::size_t long_ones = 0;
  for (const auto& [a, b] : edge_table(reduced.triangles, mesh.vertices.size()).edges) {
    if (std::abs(norm(mesh.vertices[a] - mesh.vertices[b]) - 1) > 1e-9) continue;  // a diagonal, where nothing folds
    for (const Edge& way : {Edge{a, b}, Edge{b, a}}) {
      const std::vector<Index> chain = reduced.chain(way[0], way[1]);
      ASSERT_EQ(chain.size(), 9u);
      EXPECT_EQ(chain.front(), way[0]);
      EXPECT_EQ(chain.back(), way[1]);
      for (std::size_t k = 0; k + 1 < chain.size(); ++k)
        EXPECT_TRUE(std::binary_search(edges.begin(), edges.end(), ascending(chain[k], chain[k + 1])));
    }
    ++long_ones;
  }
  EXPECT_EQ(long_ones, 12u);
}

// Features as they look: where corners are, and of each curve its kind, length and ends.
struct Look {
  std::vector<Index> corners;
  std::multiset<std::tuple<FeatureKind, long long, std::size_t>> curves;
  bool operator==(const Look&) const = default;
};

Look look_of(const TriangleMesh& mesh, const FeatureGraph& graph, std::size_t edges_each) {
  Look look{graph.corners, {}};
  for (const FeatureCurve& curve : graph.curves) {
    double length = 0;
    const std::size_t count = curve.vertices.size(), edges = count - (curve.closed ? 0 : 1);
    for (std::size_t k = 0; k < edges; ++k)
      length += norm(mesh.vertices[curve.vertices[k]] - mesh.vertices[curve.vertices[(k + 1) % count]]);
    EXPECT_EQ(edges % edges_each, 0u);
    look.curves.insert({curve.kind, std::llround(1e6 * length), edges / edges_each});
  }
  return look;
}

TEST(Features, DoNotDependOnHowFinelyTrianglesAreDivided) {
  TriangleMesh labelled = wavy_patch(8);
  for (const auto& [a, b, c] : labelled.triangles) labelled.labels.push_back(labelled.vertices[a].x < 0.5);
  TriangleMesh marked = torus(24, 10);
  marked.feature_edges = {edges_of(marked)[5], edges_of(marked)[30]};
  TriangleMesh dented = box(1);  // one corner pulled out, so that faces are no rectangles
  dented.vertices[0] = dented.vertices[0] - Vec3{0.3, 0.2, 0.1};
  for (const TriangleMesh& coarse : {rough_sphere(), icosphere(1), labelled, marked, dented, pages(), needles()}) {
    const Look look = look_of(coarse, detect_features(coarse), 1);
    TriangleMesh mesh = coarse;
    for (std::size_t parts = 2; parts <= 4; parts *= 2) {
      mesh = divided(mesh);
      const FeatureGraph graph = detect_features(mesh);
      EXPECT_TRUE(look_of(mesh, graph, parts) == look) << coarse.triangles.size() << " in " << parts;
      const std::vector<Edge> edges = edges_of(mesh);
      for (const Edge& e : graph.edges) EXPECT_TRUE(std::binary_search(edges.begin(), edges.end(), e));
      EXPECT_TRUE(std::is_sorted(graph.edges.begin(), graph.edges.end()));
    }
  }
}

}  // namespace
}  // namespace bisector::test
