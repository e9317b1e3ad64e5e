// Distances between surfaces where they are known by theory.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/parallel.h"
#include "support/models.h"

namespace bisector::test {
namespace {

TriangleMesh moved(TriangleMesh mesh, const Vec3& by) {
  for (Vec3& v : mesh.vertices) v += by;
  return mesh;
}

TriangleMesh scaled(TriangleMesh mesh, double by) {
  for (Vec3& v : mesh.vertices) v *= by;
  return mesh;
}

TEST(Distance, OfAMeshToItselfIsRounding) {
  for (const TriangleMesh& mesh : {icosphere(2), torus(12, 8), wavy_patch(6), collinear_among_good()}) {
    const DistanceReport report = measure_distance(mesh, mesh, 2000);
    EXPECT_LT(report.max, 1e-12);
    EXPECT_LE(report.mean, report.rms);
    EXPECT_LE(report.rms, report.max);
    EXPECT_EQ(report.samples, 2000u);
  }
}

TEST(Distance, OfAnyMagnitude) {
  const TriangleMesh inner = icosphere(2), outer = scaled(inner, 1.25);
  const DistanceReport expected = measure_distance(inner, outer, 500);
  for (const double scale : {0x1p-300, 0x1p-120, 0x1p120}) {
    const DistanceReport report = measure_distance(scaled(inner, scale), scaled(outer, scale), 500);
    EXPECT_NEAR(report.rms, expected.rms, 1e-9 * expected.rms) << scale;
    EXPECT_NEAR(report.max, expected.max, 1e-9 * expected.max) << scale;
  }
  for (const double wild : {1e41, std::nan("")})
    EXPECT_THROW(measure_distance(inner, scaled(outer, wild), 500), Error) << wild;
}

TEST(Distance, OfTrianglesWhoseAreaVanishes) {
  TriangleMesh needle;
  needle.vertices = {{0, 0, 0}, {1, 0, 0}, {0.5, 1e-200, 0}};
  needle.triangles = {{0, 1, 2}};
  EXPECT_THROW(measure_distance(icosphere(1), needle, 100), Error);
  const TriangleMesh both = joined(icosphere(1), needle);
  EXPECT_LT(measure_distance(icosphere(1), both, 100).rms_to_reference, 1e-10);
}

TEST(Distance, OfParallelPlanes) {
  const TriangleMesh plane = grid_patch(4, 3);  // diagonal 5
  const DistanceReport report = measure_distance(moved(plane, {0, 0, 0.25}), plane, 3000);
  for (const double figure : {report.mean, report.rms, report.max, report.rms_to_reference, report.rms_from_reference})
    EXPECT_NEAR(figure, 5, 1e-10);
}

TEST(Distance, OfASlantedPlaneIsItsHeight) {
  // Height x / 100 over [0, 1]: mean 1/2, rms 1/sqrt(3), max 1, in units of 1/100 and up to the small slope.
  const TriangleMesh plane = scaled(grid_patch(8, 8), 0.125);
  TriangleMesh slanted = plane;
  for (Vec3& v : slanted.vertices) v.z = 0.01 * v.x;
  const double percent = 100 / std::sqrt(2.0);
  const DistanceReport report = measure_distance(slanted, plane, 20000);
  EXPECT_NEAR(report.mean, percent * 0.005, percent * 2e-6);
  EXPECT_NEAR(report.rms, percent * 0.01 / std::sqrt(3.0), percent * 2e-6);
  EXPECT_NEAR(report.max, percent * 0.01, 1e-10);  // at a vertex
}

TEST(Distance, OfConcentricSpheres) {
  const TriangleMesh inner = icosphere(4), outer = scaled(inner, 1.1);
  const DistanceReport report = measure_distance(inner, outer, 5000);
  const double percent = 100 / (2 * 1.1 * std::sqrt(3.0));  // the box of the outer one is a cube, up to its facets
  const double expected = percent * 0.1;
  EXPECT_NEAR(report.mean, expected, 0.02 * expected);
  EXPECT_NEAR(report.rms, expected, 0.02 * expected);
  EXPECT_NEAR(report.max, expected, 0.02 * expected);
}

TEST(Distance, SeesWhatIsMissingOnEitherSide) {
  // One sphere of two is absent: one direction finds nothing, the other everything.
  const TriangleMesh one = icosphere(1), both = two_spheres();
  const DistanceReport missing = measure_distance(one, both, 4000), extra = measure_distance(both, one, 4000);
  EXPECT_LT(missing.rms_to_reference, 1e-12);
  EXPECT_GT(missing.rms_from_reference, 10);
  EXPECT_LT(extra.rms_from_reference, 1e-12);
  EXPECT_GT(extra.rms_to_reference, 10);
  EXPECT_EQ(missing.rms, missing.rms_from_reference);
  EXPECT_EQ(extra.rms, extra.rms_to_reference);
}

TEST(Distance, CountsVerticesOnlyForTheMaximum) {
  // A needle of almost no area sticks out by 1.
  TriangleMesh plane = grid_patch(3, 4);
  TriangleMesh spiked = plane;
  spiked.vertices.push_back({1, 1, 1});
  spiked.vertices.push_back({1 + 1e-9, 1, 0});
  spiked.triangles.push_back({5, 21, 20});
  const DistanceReport report = measure_distance(spiked, plane, 1000);
  EXPECT_NEAR(report.max, 20, 1e-10);
  EXPECT_LT(report.rms, 1e-10);
}

TEST(Distance, ScalesWithTheModel) {
  const TriangleMesh a = wavy_patch(5), b = moved(a, {0.01, 0.02, 0.03});
  const DistanceReport unit = measure_distance(a, b, 1000);
  const DistanceReport large = measure_distance(scaled(a, 0x1p60), scaled(b, 0x1p60), 1000);
  EXPECT_DOUBLE_EQ(unit.mean, large.mean);
  EXPECT_DOUBLE_EQ(unit.rms, large.rms);
  EXPECT_DOUBLE_EQ(unit.max, large.max);
}

TEST(Distance, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh a = icosphere(3), b = torus(30, 20);
  const auto measure = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    return measure_distance(a, b, 20000, 7);
  };
  const DistanceReport one = measure(1);
  for (const unsigned threads : {2u, 3u, 8u}) {
    const DistanceReport many = measure(threads);
    EXPECT_EQ(one.mean, many.mean);
    EXPECT_EQ(one.rms, many.rms);
    EXPECT_EQ(one.max, many.max);
  }
  EXPECT_NE(one.mean, measure_distance(a, b, 20000, 8).mean);
}

TEST(Distance, RefusesMeshesWithoutArea) {
  TriangleMesh flat = collinear_among_good();
  flat.triangles = {flat.triangles[1]};
  EXPECT_THROW(measure_distance(flat, icosphere(0)), Error);
  EXPECT_THROW(measure_distance(icosphere(0), {}), Error);
}

}  // namespace
}  // namespace bisector::test
