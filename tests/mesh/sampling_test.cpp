// Random points are judged by statistics: their seeds are fixed, so a test that passes always passes.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "bisector/error.h"
#include "core/degenerate.h"
#include "core/parallel.h"
#include "mesh/sampling.h"
#include "support/models.h"

namespace bisector::test {
namespace {

// Standard deviations by which the chi-square statistic exceeds its mean (Wilson and Hilferty 1931).
double chi_square_excess(const std::vector<double>& observed, const std::vector<double>& expected) {
  double chi = 0;
  std::size_t classes = 0;
  for (std::size_t i = 0; i < observed.size(); ++i) {
    if (expected[i] == 0) {
      EXPECT_EQ(observed[i], 0) << i;
      continue;
    }
    chi += (observed[i] - expected[i]) * (observed[i] - expected[i]) / expected[i];
    ++classes;
  }
  const double k = static_cast<double>(classes - 1);
  return (std::cbrt(chi / k) - (1 - 2 / (9 * k))) / std::sqrt(2 / (9 * k));
}

double area_of(const TriangleMesh& mesh, std::size_t i) {
  const Triangle& t = mesh.triangles[i];
  return triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
}

TEST(Sampling, FollowsArea) {
  for (const TriangleMesh& mesh : {torus(12, 8), wavy_patch(6), soup(40, 3), collinear_among_good()}) {
    const std::size_t n = 100'000;
    double area = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) area += area_of(mesh, i);
    std::vector<double> observed(mesh.triangles.size(), 0), expected;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      expected.push_back(static_cast<double>(n) * area_of(mesh, i) / area);
    for (const SurfaceSample& s : sample_surface(mesh, n, 11)) ++observed[s.triangle];
    EXPECT_LT(std::abs(chi_square_excess(observed, expected)), 3.5);
  }
}

TEST(Sampling, FollowsLinearDensityFromTriangleToTriangle) {
  const TriangleMesh mesh = wavy_patch(6);
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(v.x + 10 * v.y * v.y);  // vanishes in a corner
  const std::size_t n = 100'000;
  std::vector<double> observed(mesh.triangles.size(), 0), expected;
  double mass = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto [a, b, c] = mesh.triangles[i];
    expected.push_back(area_of(mesh, i) * (density[a] + density[b] + density[c]));
    mass += expected.back();
  }
  for (double& x : expected) x *= static_cast<double>(n) / mass;
  for (const SurfaceSample& s : sample_surface(mesh, n, 12, density)) ++observed[s.triangle];
  EXPECT_LT(std::abs(chi_square_excess(observed, expected)), 3.5);
}

// A triangle's m^2 similar parts: (i, j) counted along the two axes, upper or lower half of each cell.
TEST(Sampling, FollowsLinearDensityWithinATriangle) {
  const TriangleMesh mesh = single_triangle();
  for (const std::vector<double>& density :
       {std::vector<double>{}, {1, 1, 1}, {1, 2, 6}, {0, 0, 1}, {1, 0, 0}, {0, 3, 0}}) {
    const std::size_t n = 200'000, m = 8;
    const auto rho = [&](double x, double y) {
      return density.empty() ? 1.0 : density[0] * (1 - x - y) + density[1] * x + density[2] * y;
    };
    std::vector<double> observed(2 * m * m, 0), expected(2 * m * m, 0);
    double mass = 0;
    for (std::size_t i = 0; i < m; ++i)
      for (std::size_t j = 0; i + j < m; ++j)
        for (std::size_t upper = 0; upper < (i + j + 1 < m ? 2u : 1u); ++upper) {
          const double third = upper ? 2.0 / 3 : 1.0 / 3;  // the centroid's density is the mean of a linear one
          const double w = rho((static_cast<double>(i) + third) / m, (static_cast<double>(j) + third) / m);
          expected[2 * (i * m + j) + upper] = w;
          mass += w;
        }
    for (double& x : expected) x *= static_cast<double>(n) / mass;
    for (const SurfaceSample& s : sample_surface(mesh, n, 13, density)) {
      ASSERT_EQ(s.point.z, 0);
      const double x = s.point.x, y = s.point.y;  // in [0, 8]: a cell has size 1
      ASSERT_GE(std::min({x, y, 8 - x - y}), -1e-14);
      const auto i = std::min<std::size_t>(7, static_cast<std::size_t>(x));
      const auto j = std::min<std::size_t>(7 - i, static_cast<std::size_t>(y));
      const bool upper = x - static_cast<double>(i) + y - static_cast<double>(j) > 1 && i + j + 1 < m;
      ++observed[2 * (i * m + j) + (upper ? 1 : 0)];
    }
    EXPECT_LT(std::abs(chi_square_excess(observed, expected)), 3.5);
  }
}

TEST(Sampling, PointsLieInTheirTriangles) {
  const TriangleMesh mesh = soup(50, 8);
  for (const SurfaceSample& s : sample_surface(mesh, 5000, 14)) {
    const Triangle& t = mesh.triangles[s.triangle];
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const double parts = triangle_area(s.point, b, c) + triangle_area(a, s.point, c) + triangle_area(a, b, s.point);
    EXPECT_NEAR(parts, area_of(mesh, s.triangle), 1e-12);
  }
}

TEST(Sampling, PointsAreIndependentOfEachOther) {
  // Pairs of successive points fall into pairs of triangles as products of probabilities.
  TriangleMesh mesh = icosphere(0);
  const std::size_t n = 80'000, f = mesh.triangles.size();
  const auto samples = sample_surface(mesh, n, 15);
  std::vector<double> observed(f * f, 0);
  const std::vector<double> expected(f * f, static_cast<double>(n / 2) / static_cast<double>(f * f));
  for (std::size_t i = 0; i < n; i += 2) ++observed[samples[i].triangle * f + samples[i + 1].triangle];
  EXPECT_LT(std::abs(chi_square_excess(observed, expected)), 3.5);
}

TEST(Sampling, IsReproducible) {
  const TriangleMesh mesh = torus(10, 6);
  const auto equal = [](const std::vector<SurfaceSample>& a, const std::vector<SurfaceSample>& b, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i)
      if (!(a[i].point == b[i].point && a[i].triangle == b[i].triangle)) return false;
    return true;
  };
  const auto sample = [&](std::size_t n, std::uint64_t seed, unsigned threads) {
    const ThreadLimit limit(threads);
    return sample_surface(mesh, n, seed);
  };
  const auto all = sample(10'000, 1, 1);
  EXPECT_TRUE(equal(all, sample(10'000, 1, 4), 10'000));
  EXPECT_TRUE(equal(all, sample(100, 1, 1), 100));
  EXPECT_FALSE(equal(all, sample(1, 2, 1), 1));
  EXPECT_TRUE(sample(0, 1, 1).empty());
}

TEST(Sampling, NeighbouringSeedsGiveUnrelatedPoints) {
  const TriangleMesh mesh = icosphere(0);
  std::vector<double> observed(20, 0);
  const std::vector<double> expected(20, 1000);
  for (std::uint64_t seed = 0; seed < 20'000; ++seed) ++observed[sample_surface(mesh, 1, seed)[0].triangle];
  EXPECT_LT(std::abs(chi_square_excess(observed, expected)), 3.5);
}

TEST(Sampling, OfTheLeastAreaThereIs) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0.5, 1e-300, 0}};
  mesh.triangles = {{0, 0, 1}, {0, 1, 2}, {1, 1, 2}};
  for (const SurfaceSample& sample : sample_surface(mesh, 100, 1)) EXPECT_EQ(sample.triangle, 1u);
}

TEST(Sampling, RefusesWhatCannotBeSampled) {
  TriangleMesh flat = collinear_among_good();
  flat.triangles = {flat.triangles[1]};
  EXPECT_THROW(sample_surface(flat, 1, 1), Error);
  EXPECT_THROW(sample_surface({}, 1, 1), Error);
  const TriangleMesh mesh = single_triangle();
  EXPECT_THROW(sample_surface(mesh, 1, 1, {1, 1}), Error);
  EXPECT_THROW(sample_surface(mesh, 1, 1, {1, -1, 1}), Error);
  EXPECT_THROW(sample_surface(mesh, 1, 1, {0, 0, 0}), Error);
  EXPECT_THROW(sample_surface(mesh, 1, 1, {1, std::numeric_limits<double>::quiet_NaN(), 1}), Error);
}

}  // namespace
}  // namespace bisector::test
