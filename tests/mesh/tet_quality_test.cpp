// Quality and topology of tetrahedra against what is known of regular, sliver and broken ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/orientation.h"
#include "mesh/tet_quality.h"
#include "mesh/tet_topology.h"
#include "support/models.h"

namespace bisector::test {
namespace {

const std::vector<Vec3> kRegular{{1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}};

TetMesh one(const std::vector<Vec3>& corners) { return {corners, {{0, 1, 2, 3}}}; }

// An octahedron about the origin, four tetrahedra around the z axis.
TetMesh octahedron() {
  TetMesh mesh;
  mesh.vertices = {{0, 0, -1}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
  mesh.tets = {{0, 1, 2, 3}, {0, 1, 3, 4}, {0, 1, 4, 5}, {0, 1, 5, 2}};
  return mesh;
}

TEST(TetQuality, OfTheRegularTetrahedron) {
  const TetQualityReport q = measure_tet_quality(one(kRegular));
  const double angle = std::acos(1.0 / 3) * 180 / std::numbers::pi;
  EXPECT_NEAR(q.dihedral_min, angle, 1e-12);
  EXPECT_NEAR(q.dihedral_max, angle, 1e-12);
  EXPECT_NEAR(q.dihedral_min_mean, angle, 1e-12);
  EXPECT_NEAR(q.radius_ratio_min, 1, 1e-14);
  EXPECT_NEAR(q.radius_ratio_mean, 1, 1e-14);
  EXPECT_NEAR(q.volume, 8.0 / 3, 1e-14);  // of edge 2 sqrt 2
  EXPECT_NEAR(q.edge_min, std::sqrt(8), 1e-14);
  EXPECT_NEAR(q.edge_max, std::sqrt(8), 1e-14);
  EXPECT_EQ(q.dihedral_counts[7], 6u);
  EXPECT_EQ(q.inverted + q.zero_volume, 0u);
}

// Two opposite edges of a square's diagonals, h apart: dihedral angles tend to 0 and 180 degrees.
TEST(TetQuality, OfASliver) {
  const double h = 1e-3;
  const std::vector<Vec3> p{{1, 0, 0}, {-1, 0, 0}, {0, 1, h}, {0, -1, h}};
  TetMesh mesh = one(p);
  if (orientation(p[0], p[1], p[2], p[3]) < 0) std::swap(mesh.tets[0][0], mesh.tets[0][1]);
  const TetQualityReport q = measure_tet_quality(mesh);
  // The planes through the diagonals rise by h within 1: half of the angle at a diagonal is atan(1 / h).
  EXPECT_NEAR(q.dihedral_max, 2 * std::atan(1 / h) * 180 / std::numbers::pi, 1e-9);
  const double n = (1 - h * h) / (1 + h * h);  // by the normals (0, h, -1) ... of neighbouring sides
  EXPECT_GT(q.dihedral_min, 0);
  EXPECT_LT(q.dihedral_min, std::acos(n) * 180 / std::numbers::pi + 1e-9);
  EXPECT_NEAR(q.volume, 2.0 / 3 * h, 1e-15);
  EXPECT_LT(q.radius_ratio_min, 6 * h);
  EXPECT_GT(q.radius_ratio_min, 0);
}

// Radius ratio by its definition, with the centre of the circumsphere from its equations.
TEST(TetQuality, RadiusRatioIsWhatItSays) {
  SplitMix64 random(3);
  for (int i = 0; i < 200; ++i) {
    std::vector<Vec3> p(4);
    for (Vec3& v : p) v = {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    const Vec3 u = p[1] - p[0], v = p[2] - p[0], w = p[3] - p[0];
    const double det = dot(u, cross(v, w));
    if (std::abs(det) < 0.05) continue;
    if (det < 0) std::swap(p[0], p[1]);
    const Vec3 centre = (0.5 / det) * (norm2(u) * cross(v, w) + norm2(v) * cross(w, u) + norm2(w) * cross(u, v));
    double surface = 0;
    for (int k = 0; k < 4; ++k)
      surface += 0.5 * norm(cross(p[(k + 2) % 4] - p[(k + 1) % 4], p[(k + 3) % 4] - p[(k + 1) % 4]));
    const double inradius = 0.5 * std::abs(det) / surface;
    EXPECT_NEAR(radius_ratio(p[0], p[1], p[2], p[3]), 3 * inradius / norm(centre), 1e-11);
    // Dihedral angles satisfy the Gram determinant of the outer normals: their cosines weigh areas to zero sums.
    const auto angles = dihedral_angles(p[0], p[1], p[2], p[3]);
    // Facet opposite k projected on facet opposite 0: area_0 = sum area_k cos(angle between), at the edges of facet 0.
    const auto area = [&](int a, int b, int c) { return 0.5 * norm(cross(p[b] - p[a], p[c] - p[a])); };
    const double rad = std::numbers::pi / 180;
    EXPECT_NEAR(area(1, 2, 3),
                area(0, 1, 2) * std::cos(angles[3] * rad) + area(0, 1, 3) * std::cos(angles[4] * rad) +
                    area(0, 2, 3) * std::cos(angles[5] * rad),
                1e-12);
    EXPECT_NEAR(area(0, 1, 2),
                area(1, 2, 3) * std::cos(angles[3] * rad) + area(0, 1, 3) * std::cos(angles[0] * rad) +
                    area(0, 2, 3) * std::cos(angles[1] * rad),
                1e-12);
  }
}

TEST(TetQuality, CountsInvertedAndFlatOnes) {
  TetMesh mesh;
  mesh.vertices = kRegular;
  mesh.vertices.push_back({0, 0, 0});
  mesh.vertices.push_back({3, 3, 3});
  mesh.tets = {{0, 1, 2, 3}, {1, 0, 2, 3}, {0, 4, 5, 1}};
  const TetQualityReport q = measure_tet_quality(mesh);
  EXPECT_EQ(q.inverted, 1u);
  EXPECT_EQ(q.zero_volume, 1u);
  EXPECT_EQ(q.dihedral_min, 0);
  EXPECT_EQ(q.dihedral_max, 180);
  EXPECT_EQ(q.radius_ratio_min, 0);
  EXPECT_NEAR(q.radius_ratio_mean, 1, 1e-14) << "of the sound one";
  EXPECT_NEAR(q.volume, 0, 1e-14);
  EXPECT_LT(q.volume_min, 0);
  EXPECT_EQ(measure_tet_quality({}).volume, 0);
}

TEST(TetQuality, SignsAreExact) {
  // A corner one rounding off the plane of the others.
  const double e = 0x1p-52;
  EXPECT_EQ(orientation({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, 0}), 0);
  EXPECT_EQ(orientation({0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {0.3, 0.3, 1 + e}), 1);
  EXPECT_EQ(orientation({0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {0.3, 0.3, 1 - e / 2}), -1);
  TriangleMesh ball = icosphere(2);
  EXPECT_EQ(enclosed_volume_sign(ball.vertices, ball.triangles), 1);
  for (Triangle& t : ball.triangles) std::swap(t[0], t[1]);
  EXPECT_EQ(enclosed_volume_sign(ball.vertices, ball.triangles), -1);
  for (Vec3& p : ball.vertices) p.z = std::copysign(1e-300, p.z);  // hardly any volume
  EXPECT_EQ(enclosed_volume_sign(ball.vertices, ball.triangles), -1);
  for (Vec3& p : ball.vertices) p.z = 0;
  EXPECT_EQ(enclosed_volume_sign(ball.vertices, ball.triangles), 0);
}

TEST(TetTopology, OfAnOctahedron) {
  TetMesh mesh = octahedron();
  mesh.vertices.push_back({9, 9, 9});
  const TetTopology t = analyse_tet_topology(mesh);
  EXPECT_TRUE(t.conforming);
  EXPECT_EQ(t.components, 1u);
  EXPECT_EQ(t.unused_vertices, 1u);
  EXPECT_TRUE(t.boundary.manifold && t.boundary.closed && t.boundary.oriented);
  EXPECT_EQ(t.boundary.euler, 2);
  const std::vector<Triangle> facets = boundary_facets(mesh.tets);
  EXPECT_EQ(facets.size(), 8u);
  EXPECT_EQ(enclosed_volume_sign(mesh.vertices, facets), 1) << "outward";
  mesh.boundary = {facets[3]};
  mesh.boundary_labels = {4};
  mesh.feature_edges = {{0, 1}, {0, 2}};  // the first is inside
  std::vector<Index> vertices;
  const TriangleMesh surface = boundary_surface(mesh, &vertices);
  EXPECT_EQ(vertices, (std::vector<Index>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(surface.triangles, facets);
  EXPECT_EQ(std::accumulate(surface.labels.begin(), surface.labels.end(), 0), 4);
  EXPECT_EQ(surface.labels[3], 4);
  EXPECT_EQ(surface.feature_edges, (std::vector<std::array<Index, 2>>{{0, 2}}));
}

TEST(TetTopology, NamesWhatDoesNotConform) {
  TetMesh turned = octahedron();
  std::swap(turned.tets[1][0], turned.tets[1][1]);
  EXPECT_EQ(analyse_tet_topology(turned).misoriented_facets, 2u);
  EXPECT_FALSE(analyse_tet_topology(turned).conforming);

  TetMesh third = octahedron();
  third.vertices.push_back({2, 2, 0});
  third.tets.push_back({0, 1, 3, 6});
  EXPECT_EQ(analyse_tet_topology(third).overused_facets, 1u);

  TetMesh cracked = octahedron();
  cracked.vertices.push_back(cracked.vertices[3]);
  cracked.tets[1][2] = 6;
  const TetTopology t = analyse_tet_topology(cracked);
  EXPECT_EQ(t.repeated_vertices, 1u);
  EXPECT_FALSE(t.conforming);

  TetMesh two = octahedron();  // that share a vertex only
  for (std::size_t v = 0; v < 6; ++v) two.vertices.push_back(two.vertices[v] + Vec3{2, 0, 0});
  for (std::size_t i = 0; i < 4; ++i) {
    Tetrahedron tet = two.tets[i];
    for (Index& v : tet) v = v == 4 ? 2 : v + 6;
    two.tets.push_back(tet);
  }
  const TetTopology joined = analyse_tet_topology(two);
  EXPECT_EQ(joined.components, 2u);
  EXPECT_TRUE(joined.conforming);
  EXPECT_FALSE(joined.boundary.manifold);
  EXPECT_EQ(joined.boundary.non_manifold_vertices, 1u);
  EXPECT_FALSE(analyse_tet_topology({}).conforming);
}

}  // namespace
}  // namespace bisector::test
