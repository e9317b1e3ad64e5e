// Which triangles count as slivers, and which of two results is preferred.
#include "remesh/slivers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

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

TEST(Slivers, DecideAfterTopologyCurvesAndCrossings) {
  const auto judged = [](double degrees) {
    RemeshResult result;
    result.mesh = acute(degrees);
    result.topology_matches = true;
    return judge(std::move(result));
  };
  const JudgedResult good = judged(60), poor = judged(20);
  JudgedResult crossing = good, broken = good, torn = good;
  crossing.crossings = 1;
  broken.result.features.broken = 1;
  torn.result.topology_matches = false;
  EXPECT_TRUE(is_better(good, poor));
  EXPECT_TRUE(is_better(poor, crossing));
  EXPECT_TRUE(is_better(crossing, broken));
  EXPECT_TRUE(is_better(broken, torn));
  EXPECT_FALSE(is_better(good, good));
}

TEST(Slivers, AreMuchFewerByAThird) {
  const auto judged = [](std::size_t slivers) {
    JudgedResult j;
    j.slivers.bounds.points.resize(3 * slivers);
    j.slivers.bounds.lengths.resize(3 * slivers);
    return j;
  };
  EXPECT_TRUE(is_much_better(judged(0), judged(1)));
  EXPECT_TRUE(is_much_better(judged(8), judged(12)));
  EXPECT_FALSE(is_much_better(judged(9), judged(12)));
  JudgedResult whole = judged(12), broken = judged(1);
  broken.result.features.broken = 1;
  EXPECT_TRUE(is_much_better(whole, broken));
  EXPECT_FALSE(is_much_better(broken, whole));
}

// Each triangle that crosses another asks for edges of half its own at its corners, once.
TEST(Crossings, AskForShorterEdgesAtTheirTriangles) {
  TriangleMesh mesh = icosphere(3);
  EXPECT_EQ(find_crossings(mesh).pairs, 0u);
  const auto first = static_cast<Index>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{0.9, 0.1, 0.05}, {1.2, 0.1, 0.05}, {1.05, 0.1, 0.35}});
  mesh.triangles.push_back({first, first + 1, first + 2});
  const Crossings crossings = find_crossings(mesh);
  EXPECT_GT(crossings.pairs, 1u);
  EXPECT_EQ(crossings.bounds.points.size(), 3 * (crossings.pairs + 1));
  for (std::size_t k = 0; k < crossings.bounds.points.size(); ++k) {
    const double length = crossings.bounds.lengths[k];
    const bool added = std::find(mesh.vertices.begin() + first, mesh.vertices.end(), crossings.bounds.points[k]) !=
                       mesh.vertices.end();
    if (added) {
      EXPECT_NEAR(length, 0.5 * (0.3 + 2 * std::hypot(0.15, 0.3)) / 3, 1e-12);
    } else {
      EXPECT_LT(length, 0.15);
    }
  }
}

}  // namespace
}  // namespace bisector::test
