#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/parallel.h"
#include "features/local_feature_size.h"
#include "support/models.h"

namespace bisector::test {
namespace {

constexpr std::size_t kFew = 20'000;

TriangleMesh moved(TriangleMesh mesh, const auto& map) {
  for (Vec3& v : mesh.vertices) v = map(v);
  return mesh;
}

// An isometry without fixed axis.
Vec3 turn(const Vec3& p) {
  const double c = std::cos(0.7), s = std::sin(0.7);
  const Vec3 q{c * p.x - s * p.y, s * p.x + c * p.y, p.z};
  return Vec3{q.x, c * q.y - s * q.z, s * q.y + c * q.z} + Vec3{3, -2, 5};
}

TriangleMesh stacked(const TriangleMesh& sheet, double gap) {
  TriangleMesh mesh = sheet;
  const auto n = static_cast<Index>(sheet.vertices.size());
  for (const Vec3& v : sheet.vertices) mesh.vertices.push_back(v + Vec3{0, 0, gap});
  for (const auto& [a, b, c] : sheet.triangles) mesh.triangles.push_back({a + n, b + n, c + n});
  return mesh;
}

TEST(LocalFeatureSize, IsTheRadiusOfASphere) {
  for (const double size : local_feature_size(icosphere(4), kFew)) EXPECT_NEAR(size, 1, 0.03);
  // Its facets make angles of 20 degrees, which are no features.
  for (const double size : local_feature_size(icosphere(1), kFew)) EXPECT_NEAR(size, 1, 0.15);
}

TEST(LocalFeatureSize, OfATorusIsTheNearerOfCircleAndAxis) {
  for (const double size : local_feature_size(torus(96, 48), kFew)) EXPECT_NEAR(size, 0.375, 0.02);
  // A fat one, with radii 1 and 0.7: the hole's waist is nearer to the axis.
  const int nu = 96, nv = 64;
  TriangleMesh fat = torus(nu, nv);
  std::vector<double> expected;
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const double u = 2 * std::numbers::pi * i / nu, v = 2 * std::numbers::pi * j / nv, r = 1 + 0.7 * std::cos(v);
      fat.vertices[expected.size()] = {r * std::cos(u), r * std::sin(u), 0.7 * std::sin(v)};
      expected.push_back(std::min(r, 0.7));
    }
  const std::vector<double> sizes = local_feature_size(fat, kFew);
  for (std::size_t v = 0; v < sizes.size(); ++v) EXPECT_NEAR(sizes[v], expected[v], 0.03);
}

TEST(LocalFeatureSize, IsHalfTheGapOfPlates) {
  for (const double gap : {8.0, 2.0, 1.0})
    for (const double size : local_feature_size(stacked(grid_patch(20, 20), gap), kFew))
      EXPECT_NEAR(size, 0.5 * gap, 0.06 * gap);
}

TEST(LocalFeatureSize, OfAPlaneIsTheDiagonal) {
  const TriangleMesh sheet = grid_patch(12, 5), turned = moved(sheet, turn);
  for (const double size : local_feature_size(sheet, kFew)) EXPECT_EQ(size, 13);
  for (const double size : local_feature_size(turned, kFew)) EXPECT_EQ(size, bounding_box(turned.vertices).diagonal());
}

TEST(LocalFeatureSize, BordersAreNoFeatures) {
  // Half a tube about the x axis, radius 1.
  const TriangleMesh half = moved(grid_patch(40, 60), [](const Vec3& p) {
    const double angle = std::numbers::pi * p.y / 60;
    return Vec3{0.1 * p.x, std::cos(angle), std::sin(angle)};
  });
  for (const double size : local_feature_size(half, kFew)) EXPECT_NEAR(size, 1, 0.05);
}

TEST(LocalFeatureSize, VanishesAtSharpEdgesOnly) {
  const TriangleMesh cube = box(8);
  const LocalFeatureSize size(cube, kFew);
  for (std::size_t v = 0; v < cube.vertices.size(); ++v) {
    const Vec3 p = cube.vertices[v];
    std::array<double, 3> depth{std::min(p.x, 1 - p.x), std::min(p.y, 1 - p.y), std::min(p.z, 1 - p.z)};
    std::sort(depth.begin(), depth.end());
    // The medial axis leaves each edge at 45 degrees: the distance to that plane.
    EXPECT_NEAR(size(p), depth[1] / std::numbers::sqrt2, 1.5 * size.spacing());
  }
}

TEST(LocalFeatureSize, ScalesAndMovesWithTheSurface) {
  const TriangleMesh mesh = torus(40, 20);
  const std::vector<double> sizes = local_feature_size(mesh, kFew);
  const std::vector<double> larger = local_feature_size(moved(mesh, [](const Vec3& p) { return 1024 * p; }), kFew);
  const std::vector<double> tiny = local_feature_size(moved(mesh, [](const Vec3& p) { return 1e-90 * p; }), kFew);
  const std::vector<double> turned = local_feature_size(moved(mesh, turn), kFew);
  for (std::size_t v = 0; v < sizes.size(); ++v) {
    EXPECT_EQ(larger[v], 1024 * sizes[v]);
    EXPECT_NEAR(tiny[v] / 1e-90, sizes[v], 0.03 * sizes[v]);
    EXPECT_NEAR(turned[v], sizes[v], 0.05 * sizes[v]);
  }
}

TEST(LocalFeatureSize, DoesNotDependOnTheTriangulation) {
  // Half of a sphere is refined twice more than the other.
  TriangleMesh coarse = icosphere(3), fine = icosphere(5), mixed;
  for (const TriangleMesh* part : {&coarse, &fine}) {
    const auto base = static_cast<Index>(mixed.vertices.size());
    mixed.vertices.insert(mixed.vertices.end(), part->vertices.begin(), part->vertices.end());
    for (const Triangle& t : part->triangles) {
      const double z = part->vertices[t[0]].z + part->vertices[t[1]].z + part->vertices[t[2]].z;
      if ((z > 0) == (part == &fine)) mixed.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    }
  }
  for (const double size : local_feature_size(mixed, kFew)) EXPECT_NEAR(size, 1, 0.05);
}

TEST(LocalFeatureSize, NoiseIsNoFeature) {
  // A tenth of an edge tilts facets by some 10 degrees.
  SplitMix64 random(6);
  const double edge = 0.035;
  const auto shake = [&](const Vec3& p) { return (1 + 0.1 * edge * random.range(-1, 1)) * p; };
  const TriangleMesh rough = moved(icosphere(5), shake);
  for (const double size : local_feature_size(rough, kFew)) EXPECT_NEAR(size, 1, 0.1);
}

TEST(LocalFeatureSize, IsLipschitz) {
  const LocalFeatureSize size(torus(30, 15), kFew);
  SplitMix64 random(4);
  for (int i = 0; i < 1000; ++i) {
    const auto point = [&] { return Vec3{random.range(-2, 2), random.range(-2, 2), random.range(-1, 1)}; };
    const Vec3 p = point(), q = point();
    EXPECT_LE(std::abs(size(p) - size(q)), norm(p - q) + 1e-12);
  }
}

TEST(LocalFeatureSize, TakesAnySoup) {
  TriangleMesh twice = stacked(torus(20, 10), 0);
  TriangleMesh point{{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}, {{0, 1, 2}}, {}};
  for (const TriangleMesh& mesh : {soup(60, 5), duplicated_triangles(), needles(), collinear_among_good(), pages(),
                                   single_triangle(), two_spheres(), twice}) {
    const double diagonal = bounding_box(mesh.vertices).diagonal();
    for (const double size : local_feature_size(mesh, 3000)) {
      EXPECT_GT(size, 0);
      EXPECT_LE(size, diagonal);
    }
  }
  EXPECT_TRUE(local_feature_size({}).empty());
  for (const double size : local_feature_size(point)) EXPECT_EQ(size, 0);
}

TEST(LocalFeatureSize, IsTheSameWithAnyNumberOfThreads) {
  const auto sizes = [](unsigned threads) {
    const ThreadLimit limit(threads);
    return local_feature_size(torus(30, 15), kFew);
  };
  EXPECT_EQ(sizes(1), sizes(4));
}

}  // namespace
}  // namespace bisector::test
