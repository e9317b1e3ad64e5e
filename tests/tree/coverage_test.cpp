#include "tree/coverage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bisector/error.h"
#include "core/parallel.h"
#include "support/models.h"
#include "tree/loft.h"

namespace bisector {
namespace {

using test::SplitMix64;

struct Forest {
  std::vector<BranchSurface> surfaces;
  TriangleMesh mesh;
};

Forest two_branches() {
  Forest forest;
  forest.surfaces.push_back(loft_branch({{0, 0, 0}, {0, 0, 2}, {0.5, 0, 4}, {0.5, 0, 8}}, {1, 0.9, 0.8, 0.5}, 0.05));
  forest.surfaces.push_back(loft_branch({{0.5, 0, 4}, {3, 0, 5}, {5, 1, 7}}, {0.3, 0.2, 0.1}, 0.05));
  for (std::size_t b = 0; b < 2; ++b) {
    const TriangleMesh branch = branch_mesh(forest.surfaces[b], 0.02);
    const auto first = static_cast<Index>(forest.mesh.vertices.size());
    forest.mesh.vertices.insert(forest.mesh.vertices.end(), branch.vertices.begin(), branch.vertices.end());
    for (const auto& [i, j, k] : branch.triangles) forest.mesh.triangles.push_back({first + i, first + j, first + k});
    forest.mesh.labels.resize(forest.mesh.triangles.size(), static_cast<std::int32_t>(b));
  }
  return forest;
}

std::vector<Vec3> random_points(std::size_t count) {
  SplitMix64 random(1);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) p = {random.range(-2, 6), random.range(-2, 2), random.range(-1, 9)};
  return points;
}

// By the definition: the closest of a triangle's face, edges and corners.
double triangle_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = cross(b - a, c - a);
  if (dot(cross(b - a, p - a), n) >= 0 && dot(cross(c - b, p - b), n) >= 0 && dot(cross(a - c, p - c), n) >= 0)
    return std::abs(dot(p - a, n)) / norm(n);
  double best = std::numeric_limits<double>::infinity();
  for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}}) {
    const double t = std::clamp(dot(p - from, to - from) / norm2(to - from), 0.0, 1.0);
    best = std::min(best, norm(from + t * (to - from) - p));
  }
  return best;
}

TEST(Coverage, IsThatOfEveryTriangleTried) {
  const Forest forest = two_branches();
  const std::vector<Vec3> points = random_points(150);
  const std::vector<PointCoverage> covered = cover_points(points, forest.surfaces, forest.mesh);
  ASSERT_EQ(covered.size(), points.size());
  std::size_t of_second = 0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    std::vector<double> best(2, std::numeric_limits<double>::infinity());
    for (std::size_t t = 0; t < forest.mesh.triangles.size(); ++t) {
      const auto& [i, j, k] = forest.mesh.triangles[t];
      double& least = best[static_cast<std::size_t>(forest.mesh.labels[t])];
      least = std::min(least, triangle_distance(points[p], forest.mesh.vertices[i], forest.mesh.vertices[j],
                                                forest.mesh.vertices[k]));
    }
    EXPECT_NEAR(covered[p].distance, std::min(best[0], best[1]), 1e-12);
    ASSERT_LT(covered[p].branch, 2u);
    EXPECT_NEAR(best[covered[p].branch], covered[p].distance, 1e-12);
    of_second += covered[p].branch;
  }
  EXPECT_GT(of_second, 10u);
  EXPECT_LT(of_second, 140u);
}

TEST(Coverage, BothSidesOfTheSurfaceCountAndTheRadiusIsTheBranchs) {
  const Forest forest = two_branches();
  const Vec3 inside = forest.surfaces[0].axis.point(0.25);
  const double radius = forest.surfaces[0].radius(0.25);
  const std::vector<Vec3> points{inside, inside + Vec3{0, 3, 0}, forest.surfaces[1].point(0.7, 0.3),
                                 forest.surfaces[0].point(0.9, 0.3)};
  const std::vector<PointCoverage> covered = cover_points(points, forest.surfaces, forest.mesh);
  EXPECT_NEAR(covered[0].distance, radius, 0.05);
  EXPECT_NEAR(covered[1].distance, 3 - radius, 0.05);
  EXPECT_EQ(covered[2].branch, 1u);
  EXPECT_LT(covered[2].distance, 0.02);
  EXPECT_NEAR(covered[2].radius, forest.surfaces[1].radius(0.7), 0.01);
  EXPECT_NEAR(covered[3].radius, forest.surfaces[0].radius(0.9), 0.02);
}

TEST(Coverage, SharesAreCounted) {
  const std::vector<PointCoverage> points{{0.1, 0, 1}, {0.5, 0, 0.4}, {1, 0, 0.4}, {2, 0, 4}};
  EXPECT_EQ(share_within(points, 0.5), 0.5);
  EXPECT_EQ(share_within(points, 0), 0);
  EXPECT_EQ(share_within(points, 2), 1);
  EXPECT_EQ(share_within_radii(points, 1), 0.5);
  EXPECT_EQ(share_within_radii(points, 2), 0.75);
  EXPECT_EQ(share_within({}, 1), 0);
  EXPECT_EQ(share_within_radii({}, 1), 0);
}

TEST(Coverage, ThreadsDoNotMatter) {
  const Forest forest = two_branches();
  const std::vector<Vec3> points = random_points(5000);
  const std::vector<PointCoverage> many = cover_points(points, forest.surfaces, forest.mesh);
  const ThreadLimit one(1);
  const std::vector<PointCoverage> few = cover_points(points, forest.surfaces, forest.mesh);
  for (std::size_t p = 0; p < points.size(); ++p) {
    EXPECT_EQ(many[p].distance, few[p].distance);
    EXPECT_EQ(many[p].branch, few[p].branch);
    EXPECT_EQ(many[p].radius, few[p].radius);
  }
}

TEST(Coverage, BadInputIsRefused) {
  Forest forest = two_branches();
  EXPECT_TRUE(cover_points({}, forest.surfaces, forest.mesh).empty());
  EXPECT_THROW(cover_points({}, {}, forest.mesh), Error);
  EXPECT_THROW(cover_points({}, forest.surfaces, {}), Error);
  forest.mesh.labels.pop_back();
  EXPECT_THROW(cover_points({}, forest.surfaces, forest.mesh), Error);
  forest.mesh.labels.push_back(-1);
  EXPECT_THROW(cover_points({}, forest.surfaces, forest.mesh), Error);
}

}  // namespace
}  // namespace bisector
