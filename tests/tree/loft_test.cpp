#include "tree/loft.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "mesh/topology.h"
#include "support/models.h"
#include "tree/bspline.h"

namespace bisector {
namespace {

using test::enclosed_volume;
using test::SplitMix64;

void expect_closed_tube(const TriangleMesh& mesh) {
  const MeshTopology topology = analyse_topology(mesh.triangles, mesh.vertices.size());
  EXPECT_TRUE(topology.manifold);
  EXPECT_TRUE(topology.closed);
  EXPECT_TRUE(topology.oriented);
  EXPECT_EQ(topology.euler, 2);
  EXPECT_EQ(topology.components, 1u);
  EXPECT_GT(enclosed_volume(mesh), 0);
  for (const Vec3& p : mesh.vertices) ASSERT_TRUE(std::isfinite(norm2(p)));
  for (const auto& [a, b, c] : mesh.triangles)
    EXPECT_GT(norm(cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a])), 0);
}

std::vector<Vec3> line(const Vec3& from, const Vec3& to, int count) {
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) points.push_back(from + (static_cast<double>(i) / (count - 1)) * (to - from));
  return points;
}

std::vector<double> linear(double from, double to, std::size_t count) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i)
    values.push_back(from + (to - from) * static_cast<double>(i) / static_cast<double>(count - 1));
  return values;
}

std::vector<Vec3> bent_path() {
  std::vector<Vec3> points;
  for (int i = 0; i <= 30; ++i) points.push_back({2 * std::sin(i / 10.0), 1.5 * std::cos(i / 7.0), i / 3.0});
  return points;
}

// The distance from the axis, densely sampled.
double axis_distance(const BranchSurface& s, const Vec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= 4000; ++k) best = std::min(best, norm(s.axis.point(k / 4000.0) - p));
  return best;
}

TEST(Loft, WallIsTheRadiusFromTheAxis) {
  const std::vector<Vec3> points = bent_path();
  const BranchSurface s = loft_branch(points, linear(0.5, 0.2, points.size()), 0.02);
  for (int i = 0; i <= 40; ++i)
    for (int j = 0; j < 7; ++j) {
      const double u = i / 40.0, r = s.radius(u);
      EXPECT_NEAR(norm(s.point(u, j / 7.0) - s.axis.point(u)), r, 0.01 * r);
      EXPECT_NEAR(axis_distance(s, s.point(u, j / 7.0)), r, 0.02 * r);
    }
  EXPECT_EQ(s.radius(0), 0.5);
  EXPECT_NEAR(s.radius(1), 0.2, 1e-12);
}

TEST(Loft, RadiiMayFallInSteps) {
  SplitMix64 random(7);
  for (int trial = 0; trial < 15; ++trial) {
    std::vector<Vec3> points{{0, 0, 0}};
    std::vector<double> radii{random.range(0.3, 1)};
    Vec3 heading{0, 0, 1};
    for (int i = 0; i < 10 + 3 * trial; ++i) {
      heading += {random.range(-0.15, 0.15), random.range(-0.15, 0.15), random.range(-0.15, 0.15)};
      heading *= 1 / norm(heading);
      points.push_back(points.back() + random.range(0.3, 2) * heading);
      radii.push_back(radii.back() * random.range(0.85, 1));
    }
    const BranchSurface s = loft_branch(points, radii, 0.1);
    double before = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= 1000; ++i) {
      const double u = i / 1000.0, distance = norm(s.point(u, 0.13) - s.axis.point(u));
      EXPECT_NEAR(distance, s.radius(u), 0.015 * s.radius(u));
      EXPECT_LT(distance, 1.02 * before);
      before = std::min(before, distance);
    }
  }
}

TEST(Loft, SurfaceIsAPeriodicTensorProduct) {
  const std::vector<Vec3> points = bent_path();
  const BranchSurface s = loft_branch(points, linear(0.5, 0.2, points.size()), 0.02);
  ASSERT_EQ(s.control.size(), s.rows * s.columns);
  ASSERT_EQ(s.knots_u.size(), s.rows + 4);
  ASSERT_EQ(s.knots_v.size(), s.columns + 4);
  EXPECT_TRUE(std::is_sorted(s.knots_u.begin(), s.knots_u.end()));
  EXPECT_TRUE(std::is_sorted(s.knots_v.begin(), s.knots_v.end()));
  EXPECT_EQ(s.knots_v[3], 0);
  EXPECT_EQ(s.knots_v[s.columns], 1);
  for (std::size_t i = 0; i < s.rows; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_TRUE(s.control[i * s.columns + k] == s.control[(i + 1) * s.columns - 3 + k]);
  for (std::size_t j = 0; j < s.columns; ++j) {
    EXPECT_TRUE(s.control[j] == s.control[0]);
    EXPECT_TRUE(s.control[(s.rows - 1) * s.columns + j] == s.control[(s.rows - 1) * s.columns]);
  }
  // By the definition, all products summed (Eq. 3.3).
  for (const double u : {-0.7, 0.0, 0.31, 0.9, 1.5})
    for (const double v : {0.0, 0.17, 0.5, 0.93}) {
      Vec3 sum;
      const BasisFunctions a = basis_functions(s.knots_u, 3, u), b = basis_functions(s.knots_v, 3, v);
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j)
          sum += a.values[i] * b.values[j] * s.control[(a.first + i) * s.columns + b.first + j];
      EXPECT_LT(norm(s.point(u, v) - sum), 1e-13);
    }
}

TEST(Loft, NormalPointsOutwards) {
  const std::vector<Vec3> points = bent_path();
  const BranchSurface s = loft_branch(points, linear(0.5, 0.2, points.size()), 0.02);
  const double h = 1e-5;
  for (const double u : {-0.5, 0.2, 0.6, 0.97, 1.5})
    for (const double v : {0.1, 0.4, 0.8}) {
      const Vec3 normal = cross(s.point(u + h, v) - s.point(u - h, v), s.point(u, v + h) - s.point(u, v - h));
      const Vec3 inside = s.axis.point(std::clamp(u, 0.01, 0.99));
      EXPECT_GT(dot(normal, s.point(u, v) - inside), 0) << u << ' ' << v;
    }
}

TEST(Loft, CylinderAndConeHaveTheirVolumes) {
  const double length = 7, tolerance = 1e-3;
  for (const auto& [base, tip] : {std::pair{0.8, 0.8}, std::pair{0.8, 0.3}}) {
    const std::vector<Vec3> points = line({1, 2, 3}, Vec3{1, 2, 3} + (length / 3.0) * Vec3{1, 2, 2}, 6);
    const BranchSurface s = loft_branch(points, linear(base, tip, 6), 1e-3);
    const TriangleMesh mesh = branch_mesh(s, tolerance);
    expect_closed_tube(mesh);
    const double frustum = M_PI * length * (base * base + base * tip + tip * tip) / 3;
    const double cap = 2 * M_PI * tip * tip * tip / 3;
    // Sections within 0.1 % of circles, chords within the tolerance of them.
    EXPECT_NEAR(enclosed_volume(mesh), frustum + cap, (0.002 + 2 * tolerance / tip) * (frustum + cap));
  }
}

TEST(Loft, MeshIsClosedAndWithinTheTolerance) {
  const std::vector<Vec3> points = bent_path();
  const BranchSurface s = loft_branch(points, linear(0.5, 0.1, points.size()), 0.02);
  for (const double tolerance : {0.1, 0.01, 0.002}) {
    const TriangleMesh mesh = branch_mesh(s, tolerance);
    expect_closed_tube(mesh);
    EXPECT_EQ(count_self_intersections(mesh), 0u);
    for (const auto& [a, b, c] : mesh.triangles) {
      const Vec3 middle = (1 / 3.0) * (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]);
      double nearest = std::numeric_limits<double>::infinity(), at = 0;
      for (int k = 0; k <= 400; ++k)
        if (const double d = norm(s.axis.point(k / 400.0) - middle); d < nearest) nearest = d, at = k / 400.0;
      if (at > 0.02 && at < 0.98) {
        EXPECT_NEAR(nearest, s.radius(at), 2 * tolerance + 0.02 * s.radius(at));
      }
    }
  }
  EXPECT_LT(branch_mesh(s, 0.1).triangles.size(), branch_mesh(s, 0.002).triangles.size());
  EXPECT_EQ(branch_mesh(s, 0.1, 3).triangles.size() % 3, 0u);
}

TEST(Loft, ThinTwigs) {
  const std::vector<Vec3> points = bent_path();
  const BranchSurface s = loft_branch(points, linear(1e-3, 0, points.size()), 1e-3);
  expect_closed_tube(branch_mesh(s, 1e-3));
  EXPECT_NEAR(s.radii.back(), 1e-5, 1e-12);
}

TEST(Loft, SharpBendsDoNotFold) {
  SplitMix64 random(3);
  for (int trial = 0; trial < 12; ++trial) {
    const double angle = M_PI * (0.2 + 0.7 * random.unit());
    std::vector<Vec3> points = line({0, 0, 0}, {0, 0, 5}, 6);
    for (int i = 1; i <= 5; ++i) points.push_back({i * std::sin(angle), 0, 5 + i * std::cos(angle)});
    const double radius = random.range(0.3, 2);
    const BranchSurface s = loft_branch(points, linear(radius, 0.5 * radius, points.size()), 0.01);
    const TriangleMesh mesh = branch_mesh(s, 0.01);
    expect_closed_tube(mesh);
    std::size_t folds = 0;
    const double h = 1e-6;
    for (int i = 1; i < 1000; ++i)
      for (int j = 0; j < 16; ++j) {
        const double u = i / 1000.0, v = j / 16.0;
        const Vec3 normal = cross(s.point(u + h, v) - s.point(u - h, v), s.point(u, v + h) - s.point(u, v - h));
        if (dot(normal, s.point(u, v) - s.axis.point(u)) <= 0) ++folds;
      }
    EXPECT_EQ(folds, 0u) << "angle " << angle << " radius " << radius;
    for (std::size_t i = 0; i < points.size(); ++i) EXPECT_LT(axis_distance(s, points[i]), radius);
    EXPECT_EQ(s.radius(0), radius);
  }
}

TEST(Loft, DegeneratePathsStayFinite) {
  for (const std::vector<Vec3>& points :
       {std::vector<Vec3>{{0, 0, 0}, {0, 0, 1}}, std::vector<Vec3>{{0, 0, 0}, {0, 0, 1}, {0, 0, 0}},
        std::vector<Vec3>{{0, 0, 0}, {0, 0, 1e-6}}, std::vector<Vec3>{{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {1, 0, 0}},
        std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 0}}}) {
    const BranchSurface s = loft_branch(points, linear(0.7, 0.4, points.size()), 0.01);
    for (const Vec3& c : s.control) ASSERT_TRUE(std::isfinite(norm2(c)));
    const TriangleMesh mesh = branch_mesh(s, 0.05);
    const MeshTopology topology = analyse_topology(mesh.triangles, mesh.vertices.size());
    EXPECT_TRUE(topology.manifold && topology.closed && topology.oriented);
    EXPECT_EQ(topology.euler, 2);
  }
}

TEST(Loft, FarFromTheOriginItIsTheSame) {
  const std::vector<Vec3> points = bent_path();
  std::vector<Vec3> moved = points;
  for (Vec3& p : moved) p += Vec3{4e5, -5e6, 300};
  const std::vector<double> radii = linear(0.3, 0.1, points.size());
  const TriangleMesh near = branch_mesh(loft_branch(points, radii, 0.02), 0.01);
  const TriangleMesh far = branch_mesh(loft_branch(moved, radii, 0.02), 0.01);
  expect_closed_tube(far);
  EXPECT_NEAR(enclosed_volume(far), enclosed_volume(near), 1e-3 * enclosed_volume(near));
}

TEST(Loft, BadInputIsRefused) {
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}};
  EXPECT_THROW(loft_branch(points, {1}, 0.1), Error);
  EXPECT_THROW(loft_branch(points, {1, -1}, 0.1), Error);
  EXPECT_THROW(loft_branch(points, {1, std::nan("")}, 0.1), Error);
  EXPECT_THROW(loft_branch(points, {0, 0}, 0.1), Error);
  EXPECT_THROW(loft_branch({{0, 0, 0}, {0, 0, 0}}, {1, 1}, 0.1), Error);
  const BranchSurface s = loft_branch(points, {0.1, 0.1}, 0.1);
  EXPECT_THROW(branch_mesh(s, 0), Error);
  EXPECT_THROW(branch_mesh(s, std::nan("")), Error);
  EXPECT_THROW(branch_mesh(s, 0.1, 2), Error);
}

}  // namespace
}  // namespace bisector
