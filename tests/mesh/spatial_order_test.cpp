// Meshes in spatial order: the same surface, whatever order it was listed in.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "mesh/spatial_order.h"
#include "support/models.h"
#include "support/shuffled.h"

namespace bisector::test {
namespace {

TEST(SpatialOrder, DoesNotDependOnTheOrderGiven) {
  for (TriangleMesh mesh : {torus(40, 20), wavy_patch(12), pages()}) {
    mesh.labels.resize(mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.labels.size(); ++t) mesh.labels[t] = static_cast<std::int32_t>(t % 5);
    mesh.feature_edges = {{mesh.triangles[1][0], mesh.triangles[1][1]}};
    const OrderedMesh a = in_spatial_order(mesh);
    for (std::uint64_t trial = 1; trial <= 3; ++trial) {
      const OrderedMesh b = in_spatial_order(shuffled(mesh, trial));
      EXPECT_TRUE(a.mesh.vertices == b.mesh.vertices);
      EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
      EXPECT_EQ(a.mesh.labels, b.mesh.labels);
      EXPECT_EQ(a.mesh.feature_edges, b.mesh.feature_edges);
    }
  }
}

TEST(SpatialOrder, IsTheSameMesh) {
  const TriangleMesh mesh = shuffled(torus(24, 12), 9);
  const OrderedMesh ordered = in_spatial_order(mesh);
  ASSERT_EQ(ordered.vertex_of.size(), mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_TRUE(ordered.mesh.vertices[ordered.vertex_of[v]] == mesh.vertices[v]);
  ASSERT_EQ(ordered.mesh.triangles.size(), mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle &got = ordered.mesh.triangles[t], &was = mesh.triangles[ordered.mesh.face_of_triangle[t]];
    Triangle want{ordered.vertex_of[was[0]], ordered.vertex_of[was[1]], ordered.vertex_of[was[2]]};
    std::rotate(want.begin(), std::find(want.begin(), want.end(), got[0]), want.end());
    EXPECT_EQ(got, want);
  }
}

TEST(SpatialOrder, TakesFacesFromTheInput) {
  TriangleMesh mesh = grid_patch(3, 2);
  mesh.face_of_triangle.resize(mesh.triangles.size());
  for (Index t = 0; t < mesh.triangles.size(); ++t) mesh.face_of_triangle[t] = t / 2;
  mesh.vertices.push_back({9, 9, 9});  // that no triangle uses
  const OrderedMesh ordered = in_spatial_order(mesh);
  std::vector<Index> faces = ordered.mesh.face_of_triangle, want = mesh.face_of_triangle;
  std::sort(faces.begin(), faces.end());
  EXPECT_EQ(faces, want);
}

TEST(SpatialOrder, LeavesOutWhatNoTriangleUses) {
  const TriangleMesh mesh = torus(8, 6);
  TriangleMesh more = mesh;
  more.vertices.insert(more.vertices.begin(), {{1e9, 0, 0}, {0, 0, 0}});
  for (Triangle& t : more.triangles)
    for (Index& v : t) v += 2;
  const OrderedMesh want = in_spatial_order(mesh), got = in_spatial_order(more);
  EXPECT_EQ(got.mesh.vertices, want.mesh.vertices);
  EXPECT_EQ(got.mesh.triangles, want.mesh.triangles);
  ASSERT_EQ(got.vertex_of.size(), more.vertices.size());
  EXPECT_EQ(got.vertex_of[0], kNone);
  EXPECT_EQ(got.vertex_of[1], kNone);
  EXPECT_TRUE(std::equal(want.vertex_of.begin(), want.vertex_of.end(), got.vertex_of.begin() + 2));
}

}  // namespace
}  // namespace bisector::test
