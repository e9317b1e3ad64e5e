#include "bisector/polygonise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "bisector/region_borders.h"
#include "core/geometry.h"
#include "support/csg.h"
#include "support/models.h"

namespace bisector {
namespace {

using Edge = std::array<Index, 2>;

SegmentResult planes(const TriangleMesh& mesh, std::size_t proxies) {
  SegmentOptions options;
  options.proxies = proxies;
  options.surfaces = SegmentSurfaces::planes;
  return segment(mesh, options);
}

Vec3 vector_area(const PolygonisedMesh& mesh, std::size_t polygon) {
  const std::span corners(mesh.polygons.begin(polygon), mesh.polygons.size(polygon));
  return 0.5 * twice_vector_area(corners, [&](Index v) -> const Vec3& { return mesh.vertices[v]; });
}

// Simple polygons, each edge of one or two that run along it in opposite directions, with the input's topology, and
// facing where their regions do but for those that are folded.
void expect_valid(const TriangleMesh& input, const SegmentResult& segmentation, const PolygonisedMesh& result) {
  const MeshTopology before = test::topology_of(input);
  const MeshTopology after = test::topology_of(result.triangulated);
  EXPECT_EQ(after.manifold, before.manifold);
  EXPECT_EQ(after.closed, before.closed);
  EXPECT_TRUE(after.oriented);
  EXPECT_EQ(after.euler, before.euler);
  EXPECT_EQ(after.components, before.components);
  for (const Triangle& t : result.triangulated.triangles) {
    const std::vector<Vec3>& p = result.triangulated.vertices;
    EXPECT_GT(norm(twice_area_normal(p[t[0]], p[t[1]], p[t[2]])), 0);
  }

  std::set<Edge> directed, edges;
  std::set<Index> used, regions, facing_away;
  const RegionBorders borders = region_borders(input, segmentation);
  for (std::size_t k = 0; k < result.polygons.rows(); ++k) {
    const std::vector<Index> polygon(result.polygons.begin(k), result.polygons.end(k));
    EXPECT_GE(polygon.size(), 3u);
    EXPECT_EQ(std::set(polygon.begin(), polygon.end()).size(), polygon.size());
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Index a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      EXPECT_TRUE(directed.insert({a, b}).second);
      edges.insert({std::min(a, b), std::max(a, b)});
      used.insert(a);
    }
    regions.insert(result.labels[k]);
    const RegionOutline& outline = borders.regions[result.labels[k]];
    const auto* plane = std::get_if<Plane>(&segmentation.regions[result.labels[k]].proxy);
    if (plane != nullptr && !(dot(vector_area(result, k), outline.same_sense ? plane->normal : -plane->normal) > 0))
      facing_away.insert(result.labels[k]);
  }
  EXPECT_LE(facing_away.size(), result.folded);
  EXPECT_EQ(result.self_intersections, count_self_intersections(result.triangulated));
  EXPECT_EQ(used.size(), result.vertices.size());
  EXPECT_EQ(regions.size(), segmentation.regions.size());
  const auto euler =
      static_cast<long long>(used.size() + result.polygons.rows()) - static_cast<long long>(edges.size());
  EXPECT_EQ(euler, before.euler);
}

// The surface of unit cubes at integer places.
TriangleMesh cubes(const std::set<std::array<int, 3>>& places) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, Index> vertices;
  const auto vertex = [&](const std::array<int, 3>& p) {
    const auto [at, is_new] = vertices.try_emplace(p, static_cast<Index>(mesh.vertices.size()));
    if (is_new) mesh.vertices.push_back({1.0 * p[0], 1.0 * p[1], 1.0 * p[2]});
    return at->second;
  };
  for (const std::array<int, 3>& place : places)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        std::array<int, 3> beside = place;
        beside[axis] += side ? 1 : -1;
        if (places.contains(beside)) continue;
        const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        std::array<std::array<int, 3>, 4> corners;
        corners.fill(place);
        for (auto& corner : corners) corner[axis] += side;
        ++corners[1][u];
        ++corners[2][u];
        ++corners[2][v];
        ++corners[3][v];
        if (side == 0) std::swap(corners[1], corners[3]);
        mesh.triangles.push_back({vertex(corners[0]), vertex(corners[1]), vertex(corners[2])});
        mesh.triangles.push_back({vertex(corners[0]), vertex(corners[2]), vertex(corners[3])});
      }
  return mesh;
}

TEST(Polygonise, ACubeHasSixFaces) {
  for (const int n : {1, 4}) {
    const TriangleMesh mesh = test::box(n);
    const SegmentResult segmentation = planes(mesh, 6);
    const PolygonisedMesh result = polygonise(mesh, segmentation);
    expect_valid(mesh, segmentation, result);
    ASSERT_EQ(result.polygons.rows(), 6u);
    ASSERT_EQ(result.vertices.size(), 8u);
    EXPECT_EQ(result.folded, 0u);
    EXPECT_EQ(result.self_intersections, 0u);
    EXPECT_EQ(result.triangulated.triangles.size(), 12u);
    for (const Vec3& v : result.vertices)
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(v[k], std::round(v[k]), 1e-12);
    for (std::size_t k = 0; k < 6; ++k) EXPECT_EQ(result.polygons.size(k), 4u);
  }
}

TEST(Polygonise, RingsAreDivided) {
  // A frame: its top and its bottom are rings, and it has a handle.
  std::set<std::array<int, 3>> places;
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 3; ++y)
      if (x != 1 || y != 1) places.insert({x, y, 0});
  const TriangleMesh mesh = cubes(places);
  ASSERT_EQ(test::topology_of(mesh).euler, 0);
  const SegmentResult segmentation = planes(mesh, 10);
  const PolygonisedMesh result = polygonise(mesh, segmentation);
  expect_valid(mesh, segmentation, result);
  EXPECT_EQ(result.vertices.size(), 16u);
  EXPECT_EQ(result.divided, 2u);
  EXPECT_EQ(result.folded, 0u);
  EXPECT_EQ(result.self_intersections, 0u);
  double area = 0;
  for (std::size_t k = 0; k < result.polygons.rows(); ++k) area += norm(vector_area(result, k));
  EXPECT_NEAR(area, 2 * 8 + 12 + 4, 1e-9);
}

TEST(Polygonise, OpenMeshesKeepTheirBorder) {
  const TriangleMesh mesh = test::grid_patch(6, 4);
  const SegmentResult segmentation = planes(mesh, 1);
  const PolygonisedMesh result = polygonise(mesh, segmentation);
  expect_valid(mesh, segmentation, result);
  ASSERT_EQ(result.polygons.rows(), 1u);
  EXPECT_EQ(result.folded, 0u);
  EXPECT_NEAR(norm(vector_area(result, 0)), 24, 1e-9);

  const TriangleMesh wavy = test::wavy_patch(24);
  const SegmentResult pieces = planes(wavy, 12);
  const PolygonisedMesh coarse = polygonise(wavy, pieces);
  expect_valid(wavy, pieces, coarse);
  EXPECT_EQ(coarse.folded, 0u);
  EXPECT_EQ(coarse.self_intersections, 0u);
}

TEST(Polygonise, CurvedAndFewRegionsStayManifold) {
  // Two hemispheres have a border without corners, one region none at all.
  const TriangleMesh ball = test::icosphere(3);
  for (const std::size_t proxies : {1, 2, 3, 5, 30}) {
    SCOPED_TRACE(proxies);
    const SegmentResult segmentation = planes(ball, proxies);
    const PolygonisedMesh result = polygonise(ball, segmentation);
    expect_valid(ball, segmentation, result);
    EXPECT_EQ(result.folded, proxies == 1 ? 1u : 0u);  // one plane cannot hold a closed surface
  }
  const TriangleMesh ring = test::torus(40, 20);
  for (const std::size_t proxies : {1, 2, 4, 40}) {
    SCOPED_TRACE(proxies);
    const SegmentResult segmentation = planes(ring, proxies);
    expect_valid(ring, segmentation, polygonise(ring, segmentation));
  }
}

TEST(Polygonise, GeneratedParts) {
  for (const test::CsgModel& model : {test::csg_part(4000, 0, 1), test::turned_part(4000, 1e-3, 1)}) {
    const SegmentResult segmentation = planes(model.mesh, 60);
    const PolygonisedMesh result = polygonise(model.mesh, segmentation);
    expect_valid(model.mesh, segmentation, result);
    EXPECT_EQ(result.folded, 0u);
    const double diagonal = bounding_box(model.mesh.vertices).diagonal();
    EXPECT_LT(measure_distance(result.triangulated, model.mesh, 20000).rms, 100 * segmentation.rms / diagonal);
    EXPECT_EQ(result.self_intersections, 0u);
  }
}

TEST(Polygonise, OtherSurfacesKeepTheirTriangles) {
  const test::CsgModel model = test::csg_part(3000, 0, 1);
  SegmentResult segmentation;
  segmentation.labels = model.labels;
  for (const Primitive& surface : model.primitives) segmentation.regions.push_back({surface});
  const PolygonisedMesh result = polygonise(model.mesh, segmentation);
  expect_valid(model.mesh, segmentation, result);
  EXPECT_EQ(result.folded, 0u);
  std::vector<std::size_t> before(model.primitives.size(), 0), after(model.primitives.size(), 0);
  for (const Index label : model.labels) ++before[label];
  for (const Index label : result.labels) ++after[label];
  for (std::size_t r = 0; r < before.size(); ++r) {
    const bool is_plane = type_of(model.primitives[r]) == SurfaceType::plane;
    EXPECT_TRUE(is_plane ? after[r] < 5 : after[r] == before[r]) << "region " << r;
  }
}

TEST(Polygonise, FandiskOf80Planes) {
  const std::string path = test::shared_model("fandisk.off");
  if (path.empty()) GTEST_SKIP() << "no fandisk";
  const TriangleMesh mesh = read_mesh(path);
  const SegmentResult segmentation = planes(mesh, 80);
  const PolygonisedMesh result = polygonise(mesh, segmentation);
  expect_valid(mesh, segmentation, result);
  EXPECT_EQ(result.folded, 0u);
  EXPECT_EQ(result.self_intersections, 0u);
  // The polygons are about as far off as their planes.
  const double diagonal = bounding_box(mesh.vertices).diagonal();
  EXPECT_LT(measure_distance(result.triangulated, mesh, 50000).rms, 1.5 * 100 * segmentation.rms / diagonal);
}

TEST(Polygonise, BadOptionsAreErrors) {
  const TriangleMesh mesh = test::box(1);
  const SegmentResult segmentation = planes(mesh, 6);
  for (const double chord : {0.0, -1.0, std::numeric_limits<double>::infinity()})
    EXPECT_THROW(polygonise(mesh, segmentation, {chord}), Error);
}

}  // namespace
}  // namespace bisector
