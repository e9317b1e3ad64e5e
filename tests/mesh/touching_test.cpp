// Parts that touch in points and along edges: voxel models have them by the dozen, with a volume that is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <vector>

#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "core/geometry.h"
#include "core/random.h"
#include "mesh/topology.h"
#include "mesh/touching.h"
#include "support/models.h"

namespace bisector::test {
namespace {

using Voxel = std::array<int, 3>;

// The faces of these unit cubes that no two of them share, outwards, over shared vertices. With `every_face`, those
// that two share as well, once for each.
TriangleMesh surface_of(const std::set<Voxel>& voxels, bool every_face = false) {
  TriangleMesh mesh;
  std::map<Voxel, Index> vertices;
  const auto vertex = [&](const Voxel& at) {
    const auto [entry, fresh] = vertices.try_emplace(at, static_cast<Index>(mesh.vertices.size()));
    if (fresh) mesh.vertices.push_back({double(at[0]), double(at[1]), double(at[2])});
    return entry->second;
  };
  for (const Voxel& voxel : voxels)
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        Voxel beyond = voxel;
        beyond[axis] += side == 1 ? 1 : -1;
        if (!every_face && voxels.contains(beyond)) continue;
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        std::array<Index, 4> corners{};
        for (int k = 0; k < 4; ++k) {
          Voxel at = voxel;
          at[axis] += side;
          at[u] += k == 1 || k == 2;
          at[v] += k >= 2;
          corners[k] = vertex(at);
        }
        if (side == 0) std::swap(corners[1], corners[3]);
        mesh.triangles.push_back({corners[0], corners[1], corners[2]});
        mesh.triangles.push_back({corners[0], corners[2], corners[3]});
      }
  return mesh;
}

double volume_of(const TriangleMesh& mesh) {
  double six = 0;
  for (const Triangle& t : mesh.triangles)
    six += rounded_six_volume({}, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  return six / 6;
}

// Separated, with the corners of all triangles where they were.
TriangleMesh separated(const TriangleMesh& mesh) {
  TriangleMesh parts = mesh;
  const std::vector<std::array<Index, 2>> halved = halve_touching_edges(parts);
  const TriangleMesh before = parts;
  EXPECT_EQ(before.vertices.size(), mesh.vertices.size() + halved.size());
  for (std::size_t k = 0; k < halved.size(); ++k)
    EXPECT_EQ(before.vertices[mesh.vertices.size() + k],
              0.5 * (mesh.vertices[halved[k][0]] + mesh.vertices[halved[k][1]]));
  const std::vector<Index> original = separate_touching(parts);
  EXPECT_EQ(original.size(), parts.vertices.size());
  for (std::size_t t = 0; t < before.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(original[parts.triangles[t][k]], before.triangles[t][k]);
  return parts;
}

void expect_manifold(const TriangleMesh& mesh) {
  const MeshTopology topology = topology_of(mesh);
  EXPECT_TRUE(topology.manifold);
  EXPECT_TRUE(topology.closed);
  EXPECT_TRUE(topology.oriented);
}

TEST(Touching, PartsThatTouchInPointsAreSeparated) {
  // Three boxes in a row, corner to corner.
  TriangleMesh boxes = joined(joined(box(2), box(2), {1, 1, 1}), box(2), {2, 2, 2});
  const std::size_t apart = boxes.vertices.size();
  std::vector<Index> first(apart);
  for (Index v = 0; v < apart; ++v)
    first[v] = static_cast<Index>(std::find(boxes.vertices.begin(), boxes.vertices.end(), boxes.vertices[v]) -
                                  boxes.vertices.begin());
  for (Triangle& t : boxes.triangles)
    for (Index& v : t) v = first[v];
  ASSERT_EQ(topology_of(boxes).non_manifold_vertices, 2u);
  boxes.feature_edges = {{boxes.triangles[0][0], boxes.triangles[0][1]}};
  for (const Triangle& t : boxes.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      if (t[k] == first[apart - 1]) boxes.feature_edges.push_back({t[k], t[(k + 1) % 3]});
  const TriangleMesh before = boxes;
  const std::vector<Index> original = separate_touching(boxes);
  const MeshTopology topology = topology_of(boxes);
  EXPECT_TRUE(topology.manifold && topology.closed && topology.oriented);
  EXPECT_EQ(topology.components, 3u);
  EXPECT_EQ(topology.euler, 6);
  ASSERT_EQ(original.size(), boxes.vertices.size());
  EXPECT_EQ(boxes.vertices.size(), before.vertices.size() + 2);
  for (Index v = 0; v < original.size(); ++v) EXPECT_EQ(boxes.vertices[v], before.vertices[original[v]]);
  for (std::size_t t = 0; t < before.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(original[boxes.triangles[t][k]], before.triangles[t][k]);
  const EdgeTable table = edge_table(boxes.triangles, boxes.vertices.size());
  for (const std::array<Index, 2>& edge : boxes.feature_edges)
    EXPECT_TRUE(std::binary_search(table.edges.begin(), table.edges.end(), edge));
  EXPECT_EQ(edges_after_separating(boxes, original, {{0, 0}}), (std::vector<std::array<Index, 2>>{{0, 0}}));

  TriangleMesh sphere = icosphere(1);
  separate_touching(sphere);
  EXPECT_EQ(sphere.triangles, icosphere(1).triangles);
}

TEST(Touching, CubesAlongAnEdgeAreTwo) {
  const TriangleMesh two = surface_of({{0, 0, 0}, {1, 1, 0}});
  ASSERT_EQ(topology_of(two).non_manifold_edges, 1u);
  const TriangleMesh parts = separated(two);
  expect_manifold(parts);
  EXPECT_EQ(topology_of(parts).components, 2u);
  EXPECT_EQ(topology_of(parts).euler, 4);
  EXPECT_EQ(parts.triangles.size(), two.triangles.size());
}

// Where the solid goes on around both ends of the edge, the edge gets a vertex in its middle, for each side one.
TEST(Touching, AnEdgeInsideOfOneSolidIsHalved) {
  std::set<Voxel> voxels{{0, 0, 0}, {1, 1, 0}};
  for (const int z : {-1, 1})
    for (const int x : {0, 1})
      for (const int y : {0, 1}) voxels.insert({x, y, z});
  TriangleMesh solid = surface_of(voxels);
  ASSERT_EQ(topology_of(solid).non_manifold_edges, 1u);
  for (std::size_t t = 0; t < solid.triangles.size(); ++t) solid.labels.push_back(static_cast<std::int32_t>(t));
  for (const Triangle& t : solid.triangles)
    for (std::size_t k = 0; k < 3; ++k) solid.feature_edges.push_back({t[k], t[(k + 1) % 3]});
  const TriangleMesh parts = separated(solid);
  expect_manifold(parts);
  // Two plates on two pillars have one handle.
  EXPECT_EQ(topology_of(parts).euler, 0);
  EXPECT_EQ(parts.triangles.size(), solid.triangles.size() + 4);
  ASSERT_EQ(parts.labels.size(), parts.triangles.size());
  for (std::size_t t = 0; t < parts.triangles.size(); ++t)
    EXPECT_EQ(parts.face_of_triangle[t], static_cast<Index>(parts.labels[t]));
  // All edges but those that part halves of triangles.
  const EdgeTable table = edge_table(parts.triangles, parts.vertices.size());
  EXPECT_EQ(parts.feature_edges.size(), table.edges.size() - 4);
  for (const std::array<Index, 2>& edge : parts.feature_edges)
    EXPECT_TRUE(std::binary_search(table.edges.begin(), table.edges.end(), edge));
}

TEST(Touching, RandomVoxelsBecomeManifold) {
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
    SCOPED_TRACE(seed);
    SplitMix64 random(seed);
    std::set<Voxel> voxels;
    for (int x = 0; x < 5; ++x)
      for (int y = 0; y < 5; ++y)
        for (int z = 0; z < 5; ++z)
          if (random.range(0, 1) < 0.4) voxels.insert({x, y, z});
    const TriangleMesh solid = surface_of(voxels);
    ASSERT_GT(topology_of(solid).non_manifold_edges, 10u);
    const TriangleMesh parts = separated(solid);
    expect_manifold(parts);
    EXPECT_NEAR(volume_of(parts), static_cast<double>(voxels.size()), 1e-9);
  }
}

// Faces that two cubes share are there twice; each cube is a solid of its own then.
TEST(Touching, CubesWithFacesInCommonAreSeparated) {
  const TriangleMesh cubes = surface_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}}, true);
  const TriangleMesh parts = separated(cubes);
  expect_manifold(parts);
  EXPECT_EQ(topology_of(parts).components, 4u);
  EXPECT_EQ(topology_of(parts).euler, 8);
}

// A sheet that ends on a solid, and one that passes through a line of another, are no solids that touch.
TEST(Touching, SheetsThatMeetStayTogether) {
  TriangleMesh fin = surface_of({{0, 0, 0}});
  fin.vertices.push_back({2, 2, 0.5});
  std::array<Index, 2> edge{};
  for (Index v = 0; v < 8; ++v) {
    const Vec3& p = fin.vertices[v];
    if (p.x == 1 && p.y == 1) edge[p.z > 0] = v;
  }
  fin.triangles.push_back({edge[0], edge[1], 8});
  TriangleMesh cross;
  cross.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  cross.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {1, 0, 5}};
  for (const TriangleMesh& sheets : {fin, cross}) {
    ASSERT_EQ(topology_of(sheets).non_manifold_edges, 1u);
    const TriangleMesh same = separated(sheets);
    EXPECT_EQ(same.triangles, sheets.triangles);
    EXPECT_EQ(same.vertices.size(), sheets.vertices.size());
  }
}

// Of solids that are there whole, each with the faces that it shares.
TEST(SolidsWithCommonFaces, AreToldFromSheetsSeenFromBothSides) {
  EXPECT_TRUE(has_solids_with_common_faces(surface_of({{0, 0, 0}, {1, 0, 0}}, true)));
  EXPECT_TRUE(has_solids_with_common_faces(surface_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}}, true)));
  EXPECT_FALSE(has_solids_with_common_faces(surface_of({{0, 0, 0}, {1, 1, 0}}, true)));  // along an edge alone
  EXPECT_FALSE(has_solids_with_common_faces(surface_of({{0, 0, 0}, {1, 0, 0}})));
  TriangleMesh sheet = grid_patch(3, 3);
  const std::vector<Triangle> front = sheet.triangles;
  for (const auto& [a, b, c] : front) sheet.triangles.push_back({a, c, b});
  EXPECT_FALSE(has_solids_with_common_faces(sheet));
  TriangleMesh twice = surface_of({{0, 0, 0}});
  for (const Triangle& t : std::vector<Triangle>(twice.triangles)) twice.triangles.push_back(t);
  EXPECT_FALSE(has_solids_with_common_faces(twice));
}

TEST(SolidsWithCommonFaces, AreRemeshedEachForItself) {
  RemeshOptions options;
  options.vertices = 400;
  const RemeshResult result = remesh(surface_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, true), options);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.topology.components, 3u);
  EXPECT_EQ(count_self_intersections(result.mesh), 0u);
  EXPECT_NEAR(volume_of(result.mesh), 3, 1e-4);
}

}  // namespace
}  // namespace bisector::test
