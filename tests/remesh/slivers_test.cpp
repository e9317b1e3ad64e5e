// Which triangles count as slivers, and which of two results is preferred.
#include "remesh/slivers.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/models.h"

namespace bisector::test {
namespace {

// One triangle with an angle of so many degrees between two sides of length 1.
TriangleMesh acute(double degrees) {
  TriangleMesh mesh;
  const double angle = degrees * kRadiansPerDegree;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {std::cos(angle), std::sin(angle), 0}};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

TEST(Slivers, AreBelow30DegreesAndTooManyBelow25) {
  EXPECT_TRUE(find_slivers(acute(60)).bounds.points.empty());
  EXPECT_FALSE(find_slivers(icosphere(3)).worth_another_run);
  EXPECT_TRUE(find_slivers(acute(31)).bounds.points.empty());
  TriangleMesh sphere = icosphere(5);
  const auto first = static_cast<Index>(sphere.vertices.size());
  for (const double degrees : {29.0, 24.0}) {
    const TriangleMesh triangle = acute(degrees);
    TriangleMesh mesh = sphere;
    mesh.vertices.insert(mesh.vertices.end(), triangle.vertices.begin(), triangle.vertices.end());
    mesh.triangles.push_back({first, first + 1, first + 2});
    EXPECT_EQ(find_slivers(mesh).bounds.points.size(), 3u);
    EXPECT_EQ(find_slivers(mesh).worth_another_run, degrees < 25);
  }
}

TEST(Slivers, BetweenTwoFeatureEdgesAreNone) {
  TriangleMesh mesh = acute(10);
  mesh.feature_edges = {{0, 1}};
  EXPECT_EQ(find_slivers(mesh).bounds.points.size(), 3u);
  EXPECT_FALSE(find_slivers(mesh).worth_another_run);  // all there are: that is for other reasons
  mesh.feature_edges = {{0, 1}, {0, 2}};
  EXPECT_FALSE(find_slivers(mesh).worth_another_run);
  EXPECT_TRUE(find_slivers(mesh).bounds.points.empty());
}

// Equilateral triangles of that edge length fit into the sliver's height, but no edge is to shrink by more than half.
TEST(Slivers, AskForEdgesAsShortAsTheirHeight) {
  for (const double degrees : {5.0, 28.0}) {
    const SizeBounds bounds = find_slivers(acute(degrees)).bounds;
    const double angle = degrees * kRadiansPerDegree, base = 2 * std::sin(0.5 * angle);
    const double expected = std::max(1.15 * std::sin(angle), 0.5 * (2 + base) / 3);
    for (const double length : bounds.lengths) EXPECT_NEAR(length, expected, 1e-12);
  }
}

TEST(Slivers, DecideAfterTopologyAndCurves) {
  RemeshResult good;
  good.mesh = acute(60);
  good.topology_matches = true;
  RemeshResult poor = good, broken = good, torn = good;
  poor.mesh = acute(20);
  broken.features.broken = 1;
  torn.topology_matches = false;
  EXPECT_TRUE(is_better(good, poor));
  EXPECT_TRUE(is_better(poor, broken));
  EXPECT_TRUE(is_better(broken, torn));
  EXPECT_FALSE(is_better(good, good));
}

}  // namespace
}  // namespace bisector::test
