// Welding: what was one surface becomes one again, and what is near but not cracked stays as it is.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "bisector/error.h"
#include "bisector/features.h"
#include "bisector/quality.h"
#include "bisector/repair.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "mesh/topology.h"
#include "support/models.h"

namespace bisector::test {
namespace {

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles)
    sum += triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  return sum;
}

// What the header promises of every result.
void expect_consistent(const TriangleMesh& mesh, const WeldResult& result, double tolerance) {
  ASSERT_EQ(result.vertex_of.size(), mesh.vertices.size());
  EXPECT_EQ(result.mesh.vertices.size() + result.merged_vertices, mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_LE(norm(result.mesh.vertices[result.vertex_of[v]] - mesh.vertices[v]), tolerance);
  for (const Triangle& t : result.mesh.triangles) {
    EXPECT_EQ((std::set<Index>{t[0], t[1], t[2]}).size(), 3u);
    for (const Index v : t) EXPECT_LT(v, result.mesh.vertices.size());
  }
  const MeshTopology topology = analyse_topology(result.mesh.triangles, result.mesh.vertices.size());
  EXPECT_EQ(topology.boundary_edges, result.border_after);
  EXPECT_TRUE(result.mesh.labels.empty() || result.mesh.labels.size() == result.mesh.triangles.size());
}

void expect_topology_of(const TriangleMesh& a, const TriangleMesh& b) {
  const MeshTopology x = analyse_topology(a.triangles, a.vertices.size());
  const MeshTopology y = analyse_topology(b.triangles, b.vertices.size());
  EXPECT_EQ(a.vertices.size(), b.vertices.size());
  EXPECT_EQ(a.triangles.size(), b.triangles.size());
  EXPECT_EQ(x.manifold, y.manifold);
  EXPECT_EQ(x.oriented, y.oriented);
  EXPECT_EQ(x.euler, y.euler);
  EXPECT_EQ(x.components, y.components);
  EXPECT_EQ(x.boundary_edges, y.boundary_edges);
}

TEST(Weld, SoupGetsItsTopologyBack) {
  for (const TriangleMesh& mesh : {icosphere(3), torus(24, 12), box(4), grid_patch(6, 5), two_spheres()}) {
    const TriangleMesh soup = torn(mesh);
    const WeldResult result = weld(soup, 0);
    expect_consistent(soup, result, 0);
    expect_topology_of(result.mesh, mesh);
    EXPECT_EQ(result.border_before, 3 * mesh.triangles.size());
    EXPECT_EQ(result.degenerate_triangles + result.duplicate_triangles + result.split_edges, 0u);
    EXPECT_EQ(area(result.mesh), area(soup));
  }
}

TEST(Weld, CracksCloseWithinTheToleranceOnly) {
  for (const TriangleMesh& mesh : {icosphere(3), torus(24, 12), box(4), grid_patch(6, 5)}) {
    const double eps = 1e-3 * bounding_box(mesh.vertices).diagonal() / 10;
    const TriangleMesh soup = torn(mesh, eps / std::sqrt(3.0) / 2);  // corners of a vertex are within eps
    const WeldResult closed = weld(soup, 2 * eps);
    expect_consistent(soup, closed, 2 * eps);
    expect_topology_of(closed.mesh, mesh);
    const WeldResult open = weld(soup, 1e-6 * eps);
    expect_consistent(soup, open, 1e-6 * eps);
    EXPECT_EQ(open.merged_vertices, 0u);
    EXPECT_EQ(open.border_after, open.border_before);
  }
}

// Two patches side by side, a gap apart.
TriangleMesh two_patches(int n, int m, double gap) {
  TriangleMesh mesh = grid_patch(n, n);
  for (Vec3& p : mesh.vertices) p = (1.0 / n) * p;
  TriangleMesh other = grid_patch(m, m);
  const Index first = static_cast<Index>(mesh.vertices.size());
  for (const Vec3& p : other.vertices) mesh.vertices.push_back({1 + gap + p.x / m, p.y / m, 0});
  for (const Triangle& t : other.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return mesh;
}

TEST(Weld, AStraightCrackCloses) {
  const double eps = 1e-3;
  const TriangleMesh mesh = two_patches(8, 8, eps);
  const WeldResult closed = weld(mesh, 2 * eps);
  expect_consistent(mesh, closed, 2 * eps);
  EXPECT_EQ(closed.merged_vertices, 9u);
  EXPECT_EQ(closed.border_before - closed.border_after, 16u);
  EXPECT_EQ(analyse_topology(closed.mesh.triangles, closed.mesh.vertices.size()).components, 1u);
  const WeldResult open = weld(mesh, eps / 2);
  EXPECT_EQ(open.merged_vertices, 0u);
  EXPECT_EQ(open.border_after, open.border_before);
  // Vertices away from the crack are where they were.
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_TRUE(std::abs(mesh.vertices[v].x - 1) < 0.01 ||
                closed.mesh.vertices[closed.vertex_of[v]] == mesh.vertices[v]);
}

TEST(Weld, CracksWithTJunctionsCloseBySplitting) {
  const double eps = 1e-4;
  for (const auto& [n, m] : {std::pair{4, 8}, {8, 4}, {5, 7}, {1, 3}}) {
    const TriangleMesh mesh = two_patches(n, m, eps);
    const WeldResult result = weld(mesh, 2 * eps);
    expect_consistent(mesh, result, 2 * eps);
    const MeshTopology topology = analyse_topology(result.mesh.triangles, result.mesh.vertices.size());
    EXPECT_TRUE(topology.manifold);
    EXPECT_TRUE(topology.oriented);
    EXPECT_EQ(topology.components, 1u);
    EXPECT_EQ(topology.euler, 1);
    EXPECT_EQ(topology.boundary_edges, static_cast<std::size_t>(3 * n + 3 * m));  // the common side is inside
    EXPECT_GT(result.split_edges, 0u);
    EXPECT_NEAR(area(result.mesh), 2, 10 * eps);
    EXPECT_EQ(weld(mesh, 0).split_edges, 0u);
  }
}

TEST(Weld, ASlitClosesUpToItsEnd) {
  // Two halves of a patch that hang together at one edge in the middle only.
  TriangleMesh mesh = grid_patch(8, 8);
  const double eps = 0.01;
  std::vector<Index> twin(mesh.vertices.size());
  for (Index v = 0; v < twin.size(); ++v) {
    twin[v] = v;
    const Vec3 p = mesh.vertices[v];
    if (p.x != 4 || p.y > 5) continue;
    twin[v] = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.push_back({p.x + eps, p.y, 0});
  }
  const TriangleMesh whole = grid_patch(8, 8);
  for (Triangle& t : mesh.triangles) {
    double x = 0;
    for (const Index v : t) x += whole.vertices[v].x / 3;
    if (x > 4)
      for (Index& v : t) v = twin[v];
  }
  const WeldResult result = weld(mesh, 2 * eps);
  expect_consistent(mesh, result, 2 * eps);
  expect_topology_of(result.mesh, whole);
}

TEST(Weld, WhatIsThinDoesNotCollapse) {
  // A closed plate and a strip, both thinner than the tolerance; the strip's edges are shorter, too.
  TriangleMesh plate = box(8);
  for (Vec3& p : plate.vertices) p.z *= 1e-3;
  TriangleMesh strip = grid_patch(200, 2);
  for (Vec3& p : strip.vertices) p = {0.01 * p.x, 0.001 * p.y, 0};
  for (const TriangleMesh& mesh : {plate, strip})
    for (const double tolerance : {0.0, 0.002, 0.03}) {
      const WeldResult result = weld(mesh, tolerance);
      expect_consistent(mesh, result, tolerance);
      EXPECT_TRUE(result.mesh.triangles == mesh.triangles);
      EXPECT_TRUE(result.mesh.vertices == mesh.vertices);
      EXPECT_TRUE(result.mesh.face_of_triangle.empty());
    }
}

TEST(Weld, ChainsDoNotRunAway) {
  // Scraps along a line, each nearer to the next than the tolerance: nothing moves by more than that.
  TriangleMesh mesh;
  for (int i = 0; i < 200; ++i) {
    const Index first = static_cast<Index>(mesh.vertices.size());
    for (const Vec3& p : {Vec3{0.001 * i, 0, 0}, Vec3{0.001 * i, 1, 0.5 * i}, Vec3{0.001 * i, -1, 0.7 * i}})
      mesh.vertices.push_back(p);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  const WeldResult result = weld(mesh, 0.0025);
  expect_consistent(mesh, result, 0.0025);
  EXPECT_EQ(result.mesh.triangles.size(), mesh.triangles.size());
  EXPECT_GT(result.merged_vertices, 100u);
}

TEST(Weld, CountsWhatItRemovesAndKeepsTrackOfTheRest) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}, {-0.0, 1, 0}, {5, 5, 5}};
  mesh.triangles = {{0, 1, 2}, {1, 4, 3}, {2, 0, 1}, {4, 3, 5}, {0, 5, 4}};
  mesh.labels = {10, 11, 12, 13, 14};
  mesh.feature_edges = {{0, 1}, {0, 4}, {1, 4}, {2, 4}};
  const WeldResult result = weld(mesh, 0);
  expect_consistent(mesh, result, 0);
  EXPECT_EQ(result.vertex_of, (std::vector<Index>{0, 1, 2, 3, 1, 2, 4}));
  EXPECT_EQ(result.merged_vertices, 2u);
  EXPECT_EQ(result.degenerate_triangles, 1u);
  EXPECT_EQ(result.duplicate_triangles, 2u);
  EXPECT_EQ(result.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_EQ(result.mesh.labels, (std::vector<std::int32_t>{10, 13}));
  EXPECT_EQ(result.mesh.face_of_triangle, (std::vector<Index>{0, 3}));
  EXPECT_EQ(result.mesh.feature_edges, (std::vector<std::array<Index, 2>>{{0, 1}, {1, 2}}));
}

// A pair of triangles, one each way round, on an edge of a closed surface, as of a corner that is folded down.
TEST(Weld, RemovesWhatIsFoldedOntoItself) {
  TriangleMesh mesh = icosphere(1);
  const std::vector<Triangle> sphere = mesh.triangles;
  const Index a = sphere[7][0], b = sphere[7][1], c = sphere[7][2], tip = static_cast<Index>(mesh.vertices.size());
  mesh.vertices.push_back(1.2 * mesh.vertices[a] + 0.1 * mesh.vertices[c]);
  mesh.triangles.insert(mesh.triangles.end(), {{a, b, tip}, {tip, b, a}});
  mesh.feature_edges = {{a, b}, {a, tip}};
  const WeldResult result = weld(mesh, 0);
  EXPECT_EQ(result.duplicate_triangles, 2u);
  EXPECT_EQ(result.mesh.triangles, sphere);
  EXPECT_EQ(result.mesh.feature_edges, (std::vector<std::array<Index, 2>>{{std::min(a, b), std::max(a, b)}}));
}

// Of two pairs, where rounding has put a vertex all but on the edge that it was beside.
TEST(Weld, RemovesFoldsThatAreLowerThanRounding) {
  TriangleMesh mesh = icosphere(1);
  const std::vector<Triangle> sphere = mesh.triangles;
  const Index a = sphere[7][0], b = sphere[7][1], tip = static_cast<Index>(mesh.vertices.size());
  const auto along = [&](double t) { return mesh.vertices[a] + t * (mesh.vertices[b] - mesh.vertices[a]); };
  const Vec3 near = (1 + 1e-6) * along(0.4), further = (1 + 2e-6) * along(0.5);
  mesh.vertices.insert(mesh.vertices.end(), {near, further});
  mesh.triangles.insert(mesh.triangles.end(), {{a, b, tip}, {tip, b, a}, {b, tip + 1, tip}, {tip, tip + 1, b}});
  EXPECT_EQ(weld(mesh, 0).mesh.triangles, sphere);
}

TEST(Weld, KeepsOneSideOfWhatIsNotFolded) {
  // A sheet of one triangle, written for both sides.
  TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {2, 1, 0}};
  EXPECT_EQ(weld(sheet, 0).mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));

  // A sheet of two on an edge of a closed surface, and the wall between two solids.
  TriangleMesh fin = icosphere(1);
  const std::size_t sphere = fin.triangles.size();
  const auto [a, b, c] = fin.triangles[7];
  const auto tip = static_cast<Index>(fin.vertices.size());
  fin.vertices.insert(fin.vertices.end(), {2.0 * fin.vertices[a], 2.0 * fin.vertices[b]});
  fin.triangles.insert(fin.triangles.end(), {{a, b, tip}, {tip, b, a}, {b, tip + 1, tip}, {tip, tip + 1, b}});
  EXPECT_EQ(weld(fin, 0).mesh.triangles.size(), sphere + 2);

  TriangleMesh solids;
  solids.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}};
  solids.triangles = {{0, 1, 2}, {0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {1, 0, 4}, {2, 1, 4}, {0, 2, 4}};
  EXPECT_EQ(weld(solids, 0).mesh.triangles.size(), 7u);
}

TEST(Weld, FeatureEdgesAreSplitWithTheirEdges) {
  TriangleMesh mesh = two_patches(1, 4, 1e-4);
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = t[k], b = t[(k + 1) % 3];
      if (mesh.vertices[a].x == 1 && mesh.vertices[b].x == 1) mesh.feature_edges.push_back({a, b});
    }
  ASSERT_EQ(mesh.feature_edges.size(), 1u);
  const WeldResult result = weld(mesh, 2e-4);
  EXPECT_EQ(result.mesh.feature_edges.size(), 4u);
  FeatureOptions options;
  options.given = result.mesh.feature_edges;
  EXPECT_NO_THROW(detect_features(result.mesh, options));
}

TEST(Weld, WeldingTwiceChangesNothing) {
  const TriangleMesh soup = torn(icosphere(2), 1e-4);
  const WeldResult once = weld(soup, 1e-3), twice = weld(once.mesh, 1e-3);
  EXPECT_EQ(once.mesh.vertices, twice.mesh.vertices);
  EXPECT_EQ(once.mesh.triangles, twice.mesh.triangles);
  EXPECT_EQ(twice.merged_vertices, 0u);
}

TEST(Weld, RefusesWhatMakesNoSense) {
  EXPECT_THROW(weld(box(1), -1), Error);
  EXPECT_THROW(weld(box(1), std::nan("")), Error);
  EXPECT_TRUE(weld(TriangleMesh{}, 1).mesh.triangles.empty());
}

}  // namespace
}  // namespace bisector::test
