// Wraps: closed manifolds around anything that has triangles, near it wherever the ball gets to.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "bisector/repair.h"
#include "core/geometry.h"
#include "support/models.h"

namespace bisector::test {
namespace {

void expect_closed_manifold(const TriangleMesh& mesh, int euler) {
  const MeshTopology topology = analyse_topology(mesh.triangles, mesh.vertices.size());
  EXPECT_TRUE(topology.manifold && topology.closed && topology.oriented);
  EXPECT_EQ(topology.euler, euler);
  EXPECT_EQ(count_self_intersections(mesh), 0u);
}

TriangleMesh without_cap(TriangleMesh ball, double height) {
  std::erase_if(ball.triangles, [&](const Triangle& t) {
    return ball.vertices[t[0]].z > height && ball.vertices[t[1]].z > height && ball.vertices[t[2]].z > height;
  });
  return ball;
}

TEST(Wrap, OfSolidsLiesJustOutside) {
  const double alpha = 0.1;
  for (const TriangleMesh& solid : {icosphere(3), torus(40, 24), box(2)}) {
    const TriangleMesh wrapped = wrap(solid, alpha).mesh;
    const MeshTopology topology = analyse_topology(solid.triangles, solid.vertices.size());
    expect_closed_manifold(wrapped, static_cast<int>(topology.euler));
    EXPECT_GT(enclosed_volume(wrapped), enclosed_volume(solid));
    const DistanceReport distance = measure_distance(wrapped, solid);
    const double diagonal = bounding_box(solid.vertices).diagonal();
    EXPECT_LT(0.01 * distance.mean * diagonal, 0.1 * alpha);
  }
}

// Sheets that cross, without common vertices, edges of three triangles and triangles without area.
TEST(Wrap, OfSoupIsASolid) {
  TriangleMesh mesh = soup(40, 3);
  mesh.triangles.push_back(mesh.triangles[0]);
  mesh.triangles.push_back({0, 1, 1});
  const TriangleMesh wrapped = wrap(mesh, 0.05).mesh;
  const MeshTopology topology = analyse_topology(wrapped.triangles, wrapped.vertices.size());
  EXPECT_TRUE(topology.manifold && topology.closed && topology.oriented);
  EXPECT_EQ(count_self_intersections(wrapped), 0u);
  EXPECT_GT(enclosed_volume(wrapped), 0);
}

// A shell is as thick as asked for where there is a sheet; a solid's wrap stays near it.
TEST(Wrap, OfSheetsIsAsThickAsAskedFor) {
  const TriangleMesh bowl = without_cap(icosphere(4), 0.8);
  const double thickness = 0.12, alpha = 0.08;
  const WrapResult thin = wrap(bowl, alpha), thick = wrap(bowl, alpha, thickness);
  EXPECT_DOUBLE_EQ(thick.offset, thickness / 2);
  expect_closed_manifold(thick.mesh, 2);
  const auto thickness_of = [](const TriangleMesh& shell) {
    const TriangleMesh sheet = without_cap(icosphere(4), 0.8);
    double area = 0;
    for (const Triangle& t : sheet.triangles)
      area += 0.5 * norm(twice_area_normal(sheet.vertices[t[0]], sheet.vertices[t[1]], sheet.vertices[t[2]]));
    return enclosed_volume(shell) / area;
  };
  EXPECT_NEAR(thickness_of(thick.mesh), thickness, 0.2 * thickness);
  EXPECT_LT(thickness_of(thin.mesh), 0.1 * thickness);
  for (const TriangleMesh& solid : {icosphere(3), torus(40, 24), box(2)})
    EXPECT_DOUBLE_EQ(wrap(solid, alpha, thickness).offset, wrap(solid, alpha).offset);
  EXPECT_THROW(wrap(bowl, alpha, -1), Error);
}

// The ball passes through a hole of the radius 0.6 or does not.
TEST(Wrap, ClosesHolesTheBallDoesNotPassThrough) {
  const TriangleMesh bowl = without_cap(icosphere(4), 0.8);
  const TriangleMesh closed = wrap(bowl, 1.2).mesh, open = wrap(bowl, 0.1).mesh;
  expect_closed_manifold(closed, 2);
  expect_closed_manifold(open, 2);
  const double ball = 4.0 / 3 * std::numbers::pi;
  EXPECT_GT(enclosed_volume(closed), 0.8 * ball);
  EXPECT_LT(enclosed_volume(open), 0.1 * ball);
}

TEST(Wrap, FillsCavities) {
  TriangleMesh hollow = icosphere(3);
  const auto first = static_cast<Index>(hollow.vertices.size());
  const TriangleMesh inner = hollow;
  for (const Vec3& p : inner.vertices) hollow.vertices.push_back(0.5 * p);
  for (const Triangle& t : inner.triangles) hollow.triangles.push_back({t[0] + first, t[2] + first, t[1] + first});
  expect_closed_manifold(wrap(hollow, 0.1).mesh, 2);
}

TEST(Wrap, ErrorsSayWhatToDo) {
  TriangleMesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  flat.triangles = {{0, 1, 2}};
  EXPECT_THROW(wrap(flat, 0.1), Error);
  EXPECT_THROW(wrap(TriangleMesh{}, 0.1), Error);
  for (const double alpha : {0.0, -1.0, 1e-6, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(wrap(icosphere(1), alpha), Error);
  std::atomic<bool> cancel{true};
  Context context;
  context.cancel = &cancel;
  EXPECT_THROW(wrap(icosphere(1), 0.1, 0, context), Cancelled);
}

}  // namespace
}  // namespace bisector::test
