// Bounds of distances against distances that are known, and against samples.
#include "bisector/distance_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "support/models.h"

namespace bisector::test {
namespace {

TriangleMesh moved(TriangleMesh mesh, const Vec3& by) {
  for (Vec3& p : mesh.vertices) p += by;
  return mesh;
}

TriangleMesh one_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  TriangleMesh mesh;
  mesh.vertices = {a, b, c};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

void expect_hausdorff(const TriangleMesh& mesh, const TriangleMesh& reference, double expected, double gap) {
  const HausdorffBounds bounds = bound_hausdorff_distance(mesh, reference, gap);
  EXPECT_LE(bounds.lower, expected + 1e-12);
  EXPECT_GE(bounds.upper, expected - 1e-12);
  EXPECT_LE(bounds.upper - bounds.lower, gap + 1e-12);
}

TEST(DistanceBound, OfTheSameSurfaceIsRounding) {
  for (const TriangleMesh& mesh : {box(3), icosphere(3)}) {
    const HausdorffBounds bounds = bound_hausdorff_distance(mesh, mesh, 1e-6);
    EXPECT_LE(bounds.upper, 1e-6 + 1e-12);
    EXPECT_LE(bounds.lower, bounds.upper);
  }
}

// The roof over a square whose middle is `height` up is that far from the square there, and nowhere farther.
TEST(DistanceBound, FindsTheFarthestPointInsideATriangle) {
  TriangleMesh flat;
  flat.vertices = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
  flat.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const double height : {1e-3, 0.3, 5.0}) {
    TriangleMesh roof = flat;
    roof.vertices.push_back({1, 1, height});
    roof.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    expect_hausdorff(flat, roof, height, 1e-4);
    expect_hausdorff(roof, flat, height, 1e-4);
  }
  // One way alone: the flat square's corners are the roof's, and its middle is below the roof's slopes.
  const double height = 1, away = std::sqrt(0.5);  // from the middle of the square to a slope of 45 degrees
  TriangleMesh roof = flat;
  roof.vertices.push_back({1, 1, height});
  roof.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  double lower = 0, upper = 0;
  for (const TriangleDistance& found : bound_distances(flat, roof, 0, 1e-5)) {
    lower = std::max(lower, found.lower);
    upper = std::max(upper, found.upper);
  }
  EXPECT_LE(lower, away + 1e-12);
  EXPECT_GE(upper, away - 1e-12);
  EXPECT_LE(upper - lower, 2e-5);
}

TEST(DistanceBound, OfMovedAndScaledSurfaces) {
  expect_hausdorff(box(2), moved(box(2), {0.3, 0, 0}), 0.3, 1e-3);
  TriangleMesh large = icosphere(2);
  for (Vec3& p : large.vertices) p *= 1.5;
  // Of similar surfaces around the origin the vertices of the larger one are farthest.
  const HausdorffBounds bounds = bound_hausdorff_distance(icosphere(2), large, 1e-3);
  EXPECT_GE(bounds.upper, 0.5 - 1e-12);
  EXPECT_LE(bounds.lower, 0.6);
  EXPECT_LE(bounds.upper - bounds.lower, 1e-3 + 1e-12);
}

TEST(DistanceBound, HoldsForSamples) {
  const TriangleMesh fine = torus(60, 36), coarse = torus(14, 9);
  const DistanceReport sampled = measure_distance(coarse, fine, 50'000);
  const double length = sampled.max / 100 * bounding_box(fine.vertices).diagonal();
  const HausdorffBounds bounds = bound_hausdorff_distance(coarse, fine, 1e-3);
  EXPECT_GE(bounds.upper, length);
  EXPECT_LE(bounds.lower, length + 1e-3);
  EXPECT_LE(bounds.upper - bounds.lower, 1e-3 + 1e-12);
}

TEST(DistanceBound, EndsWhereEnoughIsKnown) {
  const TriangleMesh flat = one_triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const TriangleMesh above = one_triangle({0, 0, 0.5}, {1, 0, 0.5}, {0, 1, 0.5});
  const TriangleDistance far = bound_distances(flat, above, 0.4, 1e-3)[0],
                         near = bound_distances(flat, above, 0.6, 1e-3)[0];
  EXPECT_NEAR(far.lower, 0.5, 1e-12);
  EXPECT_NEAR(far.upper, 0.5, 1e-3);
  EXPECT_LE(near.upper, 0.6);
  EXPECT_GE(near.upper, 0.5);
}

TEST(DistanceBound, RefusesWhatHasNoDistance) {
  const TriangleMesh mesh = box(1);
  EXPECT_THROW(bound_hausdorff_distance(mesh, {}, 0.1), Error);
  EXPECT_THROW(bound_hausdorff_distance(mesh, mesh, 0), Error);
  TriangleMesh bad = mesh;
  bad.vertices[0].x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(bound_hausdorff_distance(bad, mesh, 0.1), Error);
  bad.triangles[0][0] = 100;
  EXPECT_THROW(bound_hausdorff_distance(mesh, bad, 0.1), Error);
}

}  // namespace
}  // namespace bisector::test
