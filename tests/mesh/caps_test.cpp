// Triangles whose corner lies on their longest edge but for rounding divide the neighbour instead.
#include "mesh/caps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/degenerate.h"
#include "core/geometry.h"
#include "mesh/stars.h"
#include "mesh/topology.h"
#include "support/models.h"

namespace bisector::test {
namespace {

constexpr double kHeight = 1e-5;

double height_of(const TriangleMesh& mesh, const Triangle& t) {
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k)
    longest = std::max(longest, norm(mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]]));
  return 2 * triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]) / longest;
}

double lowest(const TriangleMesh& mesh) {
  double least = 1e300;
  for (const Triangle& t : mesh.triangles) least = std::min(least, height_of(mesh, t));
  return least;
}

double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles)
    area += triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  return area;
}

// A box with points on the edges around its top but for `off`. The top's triangles are divided there and the sides' are
// not; between them are caps.
TriangleMesh box_with_caps(int points, double off) {
  TriangleMesh mesh = box(1);
  std::vector<Triangle> caps;
  for (Triangle& t : mesh.triangles) {
    const Triangle v = t;
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = v[k], b = v[(k + 1) % 3], c = v[(k + 2) % 3];
      const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b];
      if (p.z != 1 || q.z != 1 || mesh.vertices[c].z != 1 || (p.x != q.x && p.y != q.y)) continue;
      std::vector<Index> chain{a};
      for (int i = 1; i <= points; ++i) {
        const double s = double(i) / (points + 1);
        chain.push_back(static_cast<Index>(mesh.vertices.size()));
        Vec3 on = (1 - s) * mesh.vertices[a] + s * mesh.vertices[b];
        on += (off * (1 + 0.5 * s) * s * (1 - s)) * unit(mesh.vertices[c] - on);
        mesh.vertices.push_back(on);
      }
      chain.push_back(b);
      t = {chain[0], chain[1], c};
      for (std::size_t i = 1; i + 1 < chain.size(); ++i) caps.push_back({chain[i], chain[i + 1], c});
      for (std::size_t i = 1; i + 1 < chain.size(); ++i) caps.push_back({a, chain[i + 1], chain[i]});
      break;
    }
  }
  mesh.triangles.insert(mesh.triangles.end(), caps.begin(), caps.end());
  return mesh;
}

TEST(Caps, AreFlippedUntilNoneIsLeft) {
  for (const double off : {0.0, 1e-12, 1e-6})
    for (const int points : {1, 2, 7}) {
      TriangleMesh mesh = box_with_caps(points, off);
      ASSERT_TRUE(analyse_topology(mesh.triangles, mesh.vertices.size()).closed);
      ASSERT_LT(lowest(mesh), kHeight);
      const double area = area_of(mesh);
      const std::vector<Vec3> vertices = mesh.vertices;
      EXPECT_GE(flip_caps(mesh, kHeight, 0, {}), 2u * static_cast<unsigned>(points));
      EXPECT_GE(lowest(mesh), kHeight) << points << " " << off;
      EXPECT_EQ(mesh.vertices, vertices);
      EXPECT_NEAR(area_of(mesh), area, 10 * kHeight);
      const MeshTopology topology = analyse_topology(mesh.triangles, mesh.vertices.size());
      EXPECT_TRUE(topology.manifold && topology.closed && topology.oriented);
      EXPECT_EQ(topology.euler, 2);
      EXPECT_EQ(flip_caps(mesh, kHeight, 0, {}), 0u);
    }
}

TEST(Caps, TakeTheLabelOfTheNeighbourThatTheyDivide) {
  TriangleMesh mesh = box_with_caps(1, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    mesh.labels.push_back(height_of(mesh, mesh.triangles[t]) < kHeight ? -1 : static_cast<std::int32_t>(t));
    mesh.face_of_triangle.push_back(static_cast<Index>(t));
  }
  EXPECT_GT(flip_caps(mesh, kHeight, 0, {}), 0u);
  EXPECT_EQ(std::count(mesh.labels.begin(), mesh.labels.end(), -1), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    EXPECT_EQ(mesh.labels[t], static_cast<std::int32_t>(mesh.face_of_triangle[t]));
}

TEST(Caps, StayWhereTheirEdgeIsGivenOrABorder) {
  const TriangleMesh box = box_with_caps(1, 0);
  std::vector<std::array<Index, 2>> given;
  for (const Triangle& t : box.triangles)
    if (height_of(box, t) < kHeight)
      for (std::size_t k = 0; k < 3; ++k) given.push_back({t[(k + 1) % 3], t[k]});
  TriangleMesh mesh = box;
  EXPECT_EQ(flip_caps(mesh, kHeight, 0, given), 0u);
  EXPECT_EQ(mesh.triangles, box.triangles);
  mesh.feature_edges = given;
  EXPECT_EQ(flip_caps(mesh, kHeight, 0, {}), 0u);
  TriangleMesh alone;
  alone.vertices = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}};
  alone.triangles = {{0, 1, 2}};
  EXPECT_EQ(flip_caps(alone, kHeight, 0, {}), 0u);
}

// However small: a fine mesh has edges as long as a coarse one's caps are high.
TEST(Caps, TrianglesThatAreNotFlatAreLeft) {
  TriangleMesh mesh = icosphere(3);
  for (Vec3& p : mesh.vertices) p = {1e-6 * p.x, 1e-6 * p.y, 2e-8 * p.z};
  const std::vector<Triangle> before = mesh.triangles;
  EXPECT_EQ(flip_caps(mesh, kHeight, 0, {}), 0u);
  EXPECT_EQ(mesh.triangles, before);
}

// A corner of a flat grid that was drawn across the far edge of one of its triangles.
TEST(Caps, FoldsAreOpenedWhereTheyAreLow) {
  TriangleMesh grid;
  const int n = 4;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x) grid.vertices.push_back({double(x), double(y), 0});
  const auto at = [&](int x, int y) { return static_cast<Index>(y * (n + 1) + x); };
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      grid.triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      grid.triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  // Beyond the diagonal from (1, 1) to (2, 2), opposite to it.
  const double over = 0.05, height = over * std::sqrt(2.0);
  grid.vertices[at(2, 1)] = {1.5 - over, 1.5 + over, 0};
  const auto downwards = [](const TriangleMesh& mesh) {
    return std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& t) {
      return twice_area_normal(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]).z < 0;
    });
  };
  ASSERT_EQ(downwards(grid), 1);
  TriangleMesh mesh = grid;
  EXPECT_EQ(flip_caps(mesh, kHeight, 0.9 * height, {}), 0u);
  EXPECT_EQ(flip_caps(mesh, kHeight, 1.1 * height, {}), 1u);
  EXPECT_EQ(downwards(mesh), 0);
  EXPECT_NEAR(area_of(mesh), n * n, 1e-12);
  EXPECT_EQ(analyse_topology(mesh.triangles, mesh.vertices.size()).euler, 1);
  EXPECT_EQ(flip_caps(mesh, kHeight, 1.1 * height, {}), 0u);

  // Two triangles that are folded back together are a sheet.
  mesh = grid;
  const Index middle = static_cast<Index>(mesh.vertices.size());
  mesh.vertices.push_back(0.5 * (grid.vertices[at(2, 1)] + grid.vertices[at(2, 2)]));
  for (std::size_t t = 0, n_before = mesh.triangles.size(); t < n_before; ++t) {
    Triangle& v = mesh.triangles[t];
    if (!has_corner(v, at(2, 1)) || !has_corner(v, at(2, 2))) continue;
    Triangle rest = v;
    std::replace(v.begin(), v.end(), at(2, 1), middle);
    std::replace(rest.begin(), rest.end(), at(2, 2), middle);
    mesh.triangles.push_back(rest);
  }
  ASSERT_EQ(downwards(mesh), 2);
  EXPECT_EQ(flip_caps(mesh, kHeight, 1.1 * height, {}), 0u);
}

TEST(Caps, OthersAreLeft) {
  TriangleMesh mesh = icosphere(3);
  EXPECT_EQ(flip_caps(mesh, kHeight, 0, {}), 0u);
  EXPECT_EQ(mesh.triangles, icosphere(3).triangles);
}

}  // namespace
}  // namespace bisector::test
