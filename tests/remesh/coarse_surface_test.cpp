// Surfaces that stand in for finer ones: fewer triangles, the same shape, topology and features.
#include "remesh/coarse_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "mesh/topology.h"
#include "support/featured.h"
#include "support/models.h"

namespace bisector::test {
namespace {

std::set<std::array<double, 3>> points_of(const TriangleMesh& mesh) {
  std::set<std::array<double, 3>> points;
  for (const Vec3& v : mesh.vertices) points.insert({v.x, v.y, v.z});
  return points;
}

void expect_stands_in(const Surface& fine, const Surface* coarse) {
  ASSERT_TRUE(coarse);
  EXPECT_LT(coarse->facets.size(), 0.6 * static_cast<double>(fine.facets.size()));
  EXPECT_NEAR(coarse->area, fine.area, 0.05 * fine.area);
  const std::set<std::array<double, 3>> points = points_of(fine.mesh);
  for (const Vec3& v : coarse->mesh.vertices) EXPECT_TRUE(points.contains({v.x, v.y, v.z}));
}

TEST(CoarseSurface, HasTheTopologyOfAClosedSurface) {
  for (const TriangleMesh& mesh : {icosphere(5), torus(120, 80)}) {
    const Surface fine(mesh);
    const std::unique_ptr<Surface> coarse = coarse_surface(fine, {}, 0.2).surface;
    ASSERT_NO_FATAL_FAILURE(expect_stands_in(fine, coarse.get()));
    const MeshTopology found = topology_of(coarse->mesh), want = topology_of(mesh);
    EXPECT_TRUE(found.closed);
    EXPECT_TRUE(found.oriented);
    EXPECT_EQ(found.euler, want.euler);
    EXPECT_EQ(found.components, want.components);
  }
}

// Vertices half an edge apart: with equilateral triangles 8 for each seed, and fewer as they are.
TEST(CoarseSurface, HasAFewTrianglesForEachSeed) {
  const Surface fine(icosphere(6));
  for (const double edge : {0.1, 0.2, 0.4}) {
    const std::unique_ptr<Surface> coarse = coarse_surface(fine, {}, edge).surface;
    ASSERT_NO_FATAL_FAILURE(expect_stands_in(fine, coarse.get()));
    const double seeds = 2 / std::sqrt(3) * fine.area / (edge * edge);
    const double per_seed = static_cast<double>(coarse->facets.size()) / seeds;
    EXPECT_GT(per_seed, 3);
    EXPECT_LT(per_seed, 8);
  }
}

TEST(CoarseSurface, KeepsFeaturesAsChainsOfEdges) {
  const TriangleMesh mesh = box(32);
  const FeatureGraph graph = sharp_graph(mesh);
  const Surface fine(mesh);
  const std::unique_ptr<Surface> coarse = coarse_surface(fine, graph, 0.25).surface;
  ASSERT_NO_FATAL_FAILURE(expect_stands_in(fine, coarse.get()));
  // The faces are flat and their borders straight, so that a triangulation of them without folds has all their area.
  EXPECT_NEAR(coarse->area, fine.area, 1e-12);
  const std::set<std::array<double, 3>> points = points_of(coarse->mesh);
  for (const Index corner : graph.corners) {
    const Vec3& v = mesh.vertices[corner];
    EXPECT_TRUE(points.contains({v.x, v.y, v.z}));
  }
  double length = 0;
  for (const auto& [a, b] : sharp_graph(coarse->mesh).edges)
    length += norm(coarse->mesh.vertices[a] - coarse->mesh.vertices[b]);
  EXPECT_NEAR(length, 12, 1e-12);
}

// Of a coarse surface one that is coarser still is made, with the features that the first says it has.
TEST(CoarseSurface, IsASurfaceWithFeaturesItself) {
  for (const TriangleMesh& mesh : {box(32), wavy_patch(64)}) {
    const FeatureGraph graph = sharp_graph(mesh);
    const Surface fine(mesh);
    CoarseSurface coarse = coarse_surface(fine, graph, 0.15);
    ASSERT_NO_FATAL_FAILURE(expect_stands_in(fine, coarse.surface.get()));
    CoarseSurface coarser = coarse_surface(*coarse.surface, coarse.features, 0.3);
    ASSERT_NO_FATAL_FAILURE(expect_stands_in(*coarse.surface, coarser.surface.get()));
    for (const CoarseSurface* now : {&coarse, &coarser}) {
      const TriangleMesh& left = now->surface->mesh;
      const FeatureGraph sharp = sharp_graph(left);
      EXPECT_EQ(now->features.edges, sharp.edges);
      EXPECT_EQ(now->features.corners.size(), graph.corners.size());
      EXPECT_EQ(now->features.curves.size(), graph.curves.size());
      for (const FeatureCurve& curve : now->features.curves) {
        EXPECT_GE(curve.vertices.size(), curve.closed ? 3u : 2u);
        const auto is_corner = [&](Index v) {
          return std::binary_search(now->features.corners.begin(), now->features.corners.end(), v);
        };
        EXPECT_TRUE(curve.closed || (is_corner(curve.vertices.front()) && is_corner(curve.vertices.back())));
      }
    }
  }
}

// A closed curve goes on being one, of at least three edges.
TEST(CoarseSurface, KeepsClosedCurves) {
  const TriangleMesh mesh = torus(240, 120);
  FeatureGraph graph;
  FeatureCurve ring;
  ring.closed = true;
  for (Index v = 0; v < 240; ++v) ring.vertices.push_back(v);  // the outermost way round
  graph.curves = {ring};
  graph.edges = edges_of(graph.curves);
  const Surface fine(mesh);
  const CoarseSurface coarse = coarse_surface(fine, graph, 0.2);
  ASSERT_NO_FATAL_FAILURE(expect_stands_in(fine, coarse.surface.get()));
  ASSERT_EQ(coarse.features.curves.size(), 1u);
  EXPECT_TRUE(coarse.features.curves[0].closed);
  EXPECT_GE(coarse.features.curves[0].vertices.size(), 3u);
  const EdgeTable table = edge_table(coarse.surface->mesh.triangles, coarse.surface->mesh.vertices.size());
  for (const std::array<Index, 2>& e : coarse.features.edges)
    EXPECT_TRUE(std::binary_search(table.edges.begin(), table.edges.end(), e));
}

TEST(CoarseSurface, KeepsBordersThatAreFeatures) {
  const TriangleMesh mesh = wavy_patch(64);
  const Surface fine(mesh);
  const std::unique_ptr<Surface> coarse = coarse_surface(fine, sharp_graph(mesh), 0.15).surface;
  ASSERT_NO_FATAL_FAILURE(expect_stands_in(fine, coarse.get()));
  const MeshTopology found = topology_of(coarse->mesh);
  EXPECT_FALSE(found.closed);
  EXPECT_EQ(found.euler, 1);
}

TEST(CoarseSurface, LosesNoComponent) {
  TriangleMesh small = icosphere(3);
  for (Vec3& v : small.vertices) v *= 0.01;
  const TriangleMesh mesh = joined(icosphere(5), small, {5, 0, 0});
  const Surface fine(mesh);
  const std::unique_ptr<Surface> coarse = coarse_surface(fine, {}, 0.3).surface;
  ASSERT_NO_FATAL_FAILURE(expect_stands_in(fine, coarse.get()));
  const MeshTopology found = topology_of(coarse->mesh);
  EXPECT_EQ(found.components, 2u);
  EXPECT_EQ(found.euler, 4);
}

// A limb thinner than the vertices are apart would else become a line, and have no seeds. The sphere beside it has so
// much area that a lost limb would not be noticed there.
TEST(CoarseSurface, KeepsThinLimbs) {
  TriangleMesh limb = torus(600, 24);  // radii 1 and 0.02
  for (Vec3& v : limb.vertices) {
    const double radius = std::hypot(v.x, v.y), factor = (1 + (radius - 1) * 0.02 / 0.375) / radius;
    v = {v.x * factor, v.y * factor, v.z * 0.02 / 0.375};
  }
  const Surface fine(joined(icosphere(6), limb, {5, 0, 0}));
  const std::unique_ptr<Surface> coarse = coarse_surface(fine, {}, 0.3).surface;
  ASSERT_NO_FATAL_FAILURE(expect_stands_in(fine, coarse.get()));
  const auto limb_area = [](const Surface& surface) {
    double sum = 0;
    for (const Facet& f : surface.facets)
      if (f.corners[0].x > 2) sum += 0.5 * norm(twice_area_normal(f.corners[0], f.corners[1], f.corners[2]));
    return sum;
  };
  EXPECT_GT(limb_area(*coarse), 0.75 * limb_area(fine));
}

// Their normals cancel at every vertex, so that none can become one with another.
TEST(CoarseSurface, RefusesSheetsWithTwoSides) {
  TriangleMesh mesh = grid_patch(20, 20);
  const std::size_t count = mesh.triangles.size();
  for (std::size_t t = 0; t < count; ++t) {
    const Triangle& v = mesh.triangles[t];
    mesh.triangles.push_back({v[0], v[2], v[1]});
  }
  EXPECT_FALSE(coarse_surface(Surface(mesh), {}, 20).surface);
}

TEST(CoarseSurface, IsFinerWhereTheDensityIsHigher) {
  const TriangleMesh mesh = icosphere(6);
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(v.z > 0 ? 256 : 1);  // edges a quarter as long
  const Surface fine(mesh, density);
  const std::unique_ptr<Surface> coarse = coarse_surface(fine, {}, 0.3).surface;
  ASSERT_NO_FATAL_FAILURE(expect_stands_in(fine, coarse.get()));
  ASSERT_EQ(coarse->density.size(), coarse->mesh.vertices.size());
  const auto above =
      std::count_if(coarse->mesh.vertices.begin(), coarse->mesh.vertices.end(), [](const Vec3& v) { return v.z > 0; });
  const auto below = static_cast<std::ptrdiff_t>(coarse->mesh.vertices.size()) - above;
  EXPECT_GT(above, 8 * below);
  EXPECT_LT(above, 32 * below);
}

TEST(CoarseSurface, IsThereOnlyIfItSavesTriangles) {
  EXPECT_FALSE(coarse_surface(Surface(icosphere(3)), {}, 0.1).surface);
  // Pieces that are not joined have nothing that could become one.
  EXPECT_FALSE(coarse_surface(Surface(soup(200, 1)), {}, 10).surface);
}

}  // namespace
}  // namespace bisector::test
