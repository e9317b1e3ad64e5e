#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/geometry.h"
#include "core/parallel.h"
#include "features/curvature.h"
#include "mesh/topology.h"
#include "support/models.h"

namespace bisector::test {
namespace {

TriangleMesh moved(TriangleMesh mesh, const auto& map) {
  for (Vec3& v : mesh.vertices) v = map(v);
  return mesh;
}

// A tube about the z axis of the given radius and length, of nu x nv cells that are shifted at random by up to `jitter`
// cells; with lids if `closed`.
TriangleMesh tube(int nu, int nv, double radius, double length, double jitter, bool closed) {
  SplitMix64 random(9);
  TriangleMesh mesh;
  for (int j = 0; j <= nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const bool inner = j > 0 && j < nv;
      const double u = 2 * std::numbers::pi * (i + random.range(-jitter, jitter)) / nu;
      const double z = length * (j + (inner ? random.range(-jitter, jitter) : 0)) / nv;
      mesh.vertices.push_back({radius * std::cos(u), radius * std::sin(u), z});
    }
  const auto at = [&](int i, int j) { return static_cast<Index>(j * nu + i % nu); };
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  if (closed) {
    const auto centre = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.push_back({0, 0, 0});
    mesh.vertices.push_back({0, 0, length});
    for (int i = 0; i < nu; ++i) {
      mesh.triangles.push_back({centre, at(i + 1, 0), at(i, 0)});
      mesh.triangles.push_back({centre + 1, at(i, nv), at(i + 1, nv)});
    }
  }
  return mesh;
}

TEST(Curvature, OfASphereIsTheReciprocalOfItsRadius) {
  for (const double radius : {1.0, 20.0})
    for (const auto& [levels, tolerance] : {std::pair{3, 0.05}, {4, 0.02}}) {
      const TriangleMesh mesh = moved(icosphere(levels), [&](const Vec3& p) { return radius * p; });
      const PrincipalCurvatures c = principal_curvatures(mesh);
      for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        EXPECT_NEAR(c.min[v] * radius, 1, tolerance);
        EXPECT_NEAR(c.max[v] * radius, 1, tolerance);
        EXPECT_NEAR(dot(c.max_direction[v], mesh.vertices[v]) / radius, 0, 0.02);
      }
    }
}

TEST(Curvature, OfACylinderIsAcrossItsAxis) {
  for (const auto& [jitter, tolerance] : {std::pair{0.0, 0.03}, {0.3, 0.06}}) {
    const int nu = 60, nv = 40;
    const TriangleMesh mesh = tube(nu, nv, 2, 8, jitter, false);
    const PrincipalCurvatures c = principal_curvatures(mesh);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      EXPECT_NEAR(c.min[v], 0, tolerance) << v;
      EXPECT_NEAR(c.max[v], 0.5, tolerance) << v;  // the borders, too
      EXPECT_NEAR(std::abs(c.min_direction[v].z), 1, 0.02);
      EXPECT_NEAR(c.max_direction[v].z, 0, 0.1);
      EXPECT_EQ(c.magnitude(v), std::max(std::abs(c.min[v]), std::abs(c.max[v])));
    }
  }
}

TEST(Curvature, DoesNotMindNeedles) {
  // Facets as long as the tube.
  const TriangleMesh mesh = tube(48, 1, 1, 30, 0, false);
  const PrincipalCurvatures c = principal_curvatures(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    EXPECT_NEAR(c.max[v], 1, 0.05);
    EXPECT_NEAR(c.min[v], 0, 0.02);
  }
}

TEST(Curvature, OfATorus) {
  const int nu = 120, nv = 60;
  const TriangleMesh mesh = torus(nu, nv);
  const PrincipalCurvatures c = principal_curvatures(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double along = std::cos(2 * std::numbers::pi * static_cast<double>(v / nu) / nv);
    EXPECT_NEAR(c.max[v], 1 / 0.375, 0.12);
    EXPECT_NEAR(c.min[v], along / (1 + 0.375 * along), 0.08);
    // The larger one belongs to the small circle.
    EXPECT_NEAR(dot(c.min_direction[v], mesh.vertices[v]), 0, 0.05);
  }
}

TEST(Curvature, OfAPlaneIsZero) {
  const TriangleMesh mesh = grid_patch(8, 6);
  const PrincipalCurvatures c = principal_curvatures(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) EXPECT_EQ(c.magnitude(v), 0);
  // Sheets that meet in an edge of three triangles do not bend there.
  const TriangleMesh book = pages();
  const PrincipalCurvatures d = principal_curvatures(book);
  for (std::size_t v = 0; v < book.vertices.size(); ++v) EXPECT_NEAR(d.magnitude(v), 0, 1e-12);
}

TEST(Curvature, OfASaddleHasBothSigns) {
  const TriangleMesh mesh = moved(grid_patch(80, 80), [](const Vec3& p) {
    const double x = (p.x - 40) / 80, y = (p.y - 40) / 80;
    return Vec3{x, y, 0.5 * (x * x - y * y)};
  });
  const std::size_t centre = 40 * 81 + 40;
  ASSERT_EQ(norm(mesh.vertices[centre]), 0);
  const PrincipalCurvatures c = principal_curvatures(mesh);
  // Against the normal +z it is convex along y.
  EXPECT_NEAR(c.max[centre], 1, 0.03);
  EXPECT_NEAR(c.min[centre], -1, 0.03);
  EXPECT_NEAR(std::abs(c.max_direction[centre].y), 1, 0.01);
  EXPECT_NEAR(std::abs(c.min_direction[centre].x), 1, 0.01);
}

TEST(Curvature, SharpEdgesCanBeLeftOut) {
  const TriangleMesh cube = box(4);
  std::vector<std::array<Index, 2>> creases;
  const auto planes = [&](Index v) {
    const Vec3& p = cube.vertices[v];
    std::array<int, 3> side{};
    for (int k = 0; k < 3; ++k) side[k] = p[k] == 0 ? -1 : p[k] == 1 ? 1 : 0;
    return side;
  };
  for (const auto& [a, b] : edge_table(cube.triangles, cube.vertices.size()).edges) {
    int common = 0;
    for (int k = 0; k < 3; ++k) common += planes(a)[k] != 0 && planes(a)[k] == planes(b)[k];
    if (common == 2) creases.push_back({a, b});
  }
  ASSERT_EQ(creases.size(), 48u);
  const PrincipalCurvatures with = principal_curvatures(cube), without = principal_curvatures(cube, creases);
  for (std::size_t v = 0; v < cube.vertices.size(); ++v) EXPECT_EQ(without.magnitude(v), 0);
  for (const auto& [a, b] : creases) EXPECT_GT(with.magnitude(a), 0.5);
}

TEST(Curvature, AtASharpRimIsThatOfTheRounderSide) {
  const int nu = 60, nv = 20;
  const TriangleMesh can = tube(nu, nv, 1, 2, 0, true);
  std::vector<std::array<Index, 2>> rims;
  for (Index i = 0; i < nu; ++i)
    for (const Index base : {Index{0}, Index{nu * nv}})
      rims.push_back({base + std::min(i, (i + 1) % nu), base + std::max(i, (i + 1) % nu)});
  const PrincipalCurvatures c = principal_curvatures(can, rims);
  for (Index v = 0; v < nu * (nv + 1); ++v) EXPECT_NEAR(c.max[v], 1, 0.1) << v;
  EXPECT_EQ(c.magnitude(nu * (nv + 1)), 0);  // the middle of a lid
}

TEST(Curvature, FollowsTheOrientation) {
  const TriangleMesh mesh = torus(40, 20);
  TriangleMesh inward = mesh, mixed = mesh;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::swap(inward.triangles[t][0], inward.triangles[t][1]);
    if (t % 3 == 0) std::swap(mixed.triangles[t][0], mixed.triangles[t][1]);
  }
  const PrincipalCurvatures c = principal_curvatures(mesh), d = principal_curvatures(inward);
  const PrincipalCurvatures e = principal_curvatures(mixed);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    EXPECT_NEAR(d.min[v], -c.max[v], 1e-9);
    EXPECT_NEAR(d.max[v], -c.min[v], 1e-9);
    EXPECT_NEAR(e.magnitude(v), c.magnitude(v), 1e-9);
  }
}

TEST(Curvature, ScalesWithTheSurface) {
  const TriangleMesh mesh = torus(24, 12);
  const PrincipalCurvatures c = principal_curvatures(mesh);
  const PrincipalCurvatures d = principal_curvatures(moved(mesh, [](const Vec3& p) { return 0x1p300 * p; }));
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    EXPECT_EQ(d.max[v] * 0x1p300, c.max[v]);
    EXPECT_EQ(d.min[v] * 0x1p300, c.min[v]);
  }
}

TEST(Curvature, TriangulationShowsLittle) {
  // The same cylinder with a flat triangle put into every edge of one row.
  TriangleMesh mesh = tube(60, 20, 2, 8, 0, false);
  const PrincipalCurvatures before = principal_curvatures(mesh);
  const std::size_t n = mesh.vertices.size(), f = mesh.triangles.size();
  for (std::size_t t = 600; t < 720 && t < f; t += 2) {
    const auto [a, b, c] = mesh.triangles[t];
    const auto m = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
    mesh.triangles[t] = {a, m, c};
    mesh.triangles.push_back({m, b, c});
    mesh.triangles.push_back({a, b, m});
  }
  const PrincipalCurvatures after = principal_curvatures(mesh);
  for (std::size_t v = 0; v < n; ++v) EXPECT_NEAR(after.max[v], before.max[v], 0.1);
}

TEST(Curvature, TakesAnySoup) {
  for (const TriangleMesh& mesh : {soup(60, 5), duplicated_triangles(), needles(), collinear_among_good(), pages(),
                                   single_triangle(), two_spheres(), TriangleMesh{}}) {
    const PrincipalCurvatures c = principal_curvatures(mesh);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      EXPECT_TRUE(std::isfinite(c.min[v]) && std::isfinite(c.max[v]));
      EXPECT_LE(c.min[v], c.max[v]);
    }
  }
}

TEST(Curvature, IsTheSameWithAnyNumberOfThreads) {
  const auto values = [](unsigned threads) {
    const ThreadLimit limit(threads);
    return principal_curvatures(torus(40, 20)).max;
  };
  EXPECT_EQ(values(1), values(4));
}

}  // namespace
}  // namespace bisector::test
