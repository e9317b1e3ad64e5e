// Sheets that cross only because triangles are chords are pushed apart, by little; others are left.
#include "remesh/push_apart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "support/models.h"

namespace bisector::test {
namespace {

using Pairs = std::vector<std::array<Index, 2>>;

// A sphere, and a cap of radius `radius` around its middle with other triangles.
TriangleMesh sphere_and_cap(double radius) {
  TriangleMesh cap = icosphere(4);
  const double c = std::cos(0.3), s = std::sin(0.3);
  for (Vec3& v : cap.vertices) {
    v = {c * v.x - s * v.y, s * v.x + c * v.y, v.z};
    v = {v.x, c * v.y - s * v.z, s * v.y + c * v.z};
    v = radius * v;
  }
  std::erase_if(cap.triangles, [&](const Triangle& t) {
    return cap.vertices[t[0]].z + cap.vertices[t[1]].z + cap.vertices[t[2]].z < 2.9;
  });
  return joined(icosphere(4), cap);
}

double mean_edge(const TriangleMesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) sum += norm(mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]]);
  return sum / static_cast<double>(3 * mesh.triangles.size());
}

TEST(PushApart, NearSheetsCrossNoMore) {
  for (const double gap : {-5e-4, 2e-4, 5e-4}) {
    SCOPED_TRACE(gap);
    const TriangleMesh before = sphere_and_cap(1 + gap);
    const Pairs pairs = find_self_intersections(before);
    ASSERT_GT(pairs.size(), 20u);
    TriangleMesh mesh = before;
    EXPECT_TRUE(push_apart(mesh, pairs, std::vector<char>(mesh.vertices.size(), 1), 0));
    EXPECT_EQ(count_self_intersections(mesh), 0u);
    EXPECT_TRUE(mesh.triangles == before.triangles);
    double farthest = 0;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
      farthest = std::max(farthest, norm(mesh.vertices[v] - before.vertices[v]));
    EXPECT_GT(farthest, 0);
    EXPECT_LT(farthest, 0.12 * mean_edge(before));  // a tenth of the edges around each
    EXPECT_GE(measure_quality(mesh).theta_min, 30);
  }
}

TEST(PushApart, OnlyWhatIsMovableMoves) {
  const TriangleMesh before = sphere_and_cap(1.0003);
  const std::size_t first = icosphere(4).vertices.size();
  std::vector<char> movable(before.vertices.size(), 1);
  std::fill(movable.begin(), movable.begin() + static_cast<std::ptrdiff_t>(first), char{0});
  const Pairs pairs = find_self_intersections(before);
  TriangleMesh mesh = before;
  EXPECT_TRUE(push_apart(mesh, pairs, movable, pairs.size()));
  EXPECT_LT(count_self_intersections(mesh), pairs.size());
  for (std::size_t v = 0; v < first; ++v) EXPECT_TRUE(mesh.vertices[v] == before.vertices[v]);
}

TEST(PushApart, SheetsThatCrossStay) {
  TriangleMesh across = icosphere(3);
  for (Vec3& v : across.vertices) v = v + Vec3{0.83, 0.21, 0.13};
  const TriangleMesh before = joined(icosphere(3), across);
  const Pairs pairs = find_self_intersections(before);
  ASSERT_GT(pairs.size(), 20u);
  TriangleMesh mesh = before;
  EXPECT_FALSE(push_apart(mesh, pairs, std::vector<char>(mesh.vertices.size(), 1), pairs.size() / 2));
  EXPECT_TRUE(mesh.vertices == before.vertices);
}

TEST(PushApart, NothingCrosses) {
  TriangleMesh mesh = icosphere(2);
  const TriangleMesh before = mesh;
  EXPECT_FALSE(push_apart(mesh, {}, std::vector<char>(mesh.vertices.size(), 1), 0));
  EXPECT_TRUE(mesh.vertices == before.vertices);
}

}  // namespace
}  // namespace bisector::test
