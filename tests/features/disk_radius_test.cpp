// How far a surface is a disk around its points, where that is known.
#include "features/disk_radius.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "support/models.h"

namespace bisector::test {
namespace {

constexpr double kStep = 0.8;

// An open tube about the x axis, of triangles of about the same size.
TriangleMesh tube(double diameter, double length, int around) {
  const int along = static_cast<int>(length / (std::numbers::pi * diameter) * around) + 1;
  TriangleMesh mesh;
  for (int i = 0; i <= along; ++i)
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around;
      mesh.vertices.push_back({length * i / along, 0.5 * diameter * std::cos(angle), 0.5 * diameter * std::sin(angle)});
    }
  const auto at = [&](int i, int k) { return static_cast<Index>(i * around + k % around); };
  for (int i = 0; i < along; ++i)
    for (int k = 0; k < around; ++k) {
      mesh.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  return mesh;
}

std::vector<double> radii_on(const TriangleMesh& mesh, std::vector<SurfaceSample>& points, double most, double least) {
  points = sample_surface(mesh, 200, 7);
  return disk_radii(mesh, points, std::vector<double>(points.size(), most), least);
}

TEST(DiskRadii, OfATubeAreItsDiameterHoweverFineItsTriangles) {
  for (const int around : {6, 24, 96}) {
    std::vector<SurfaceSample> points;
    const TriangleMesh mesh = tube(0.3, 4, around);
    const std::vector<double> radii = radii_on(mesh, points, 1, 0.05);
    for (std::size_t k = 0; k < points.size(); ++k) {
      // A hexagon's sides are nearer to each other than its corners.
      EXPECT_LE(radii[k], 0.3);
      EXPECT_GE(radii[k], kStep * 0.3 * std::cos(std::numbers::pi / around) * 0.99);
    }
  }
}

TEST(DiskRadii, OfASphereAreItsDiameter) {
  std::vector<SurfaceSample> points;
  const TriangleMesh sphere = icosphere(4);
  for (const double radius : radii_on(sphere, points, 1.9, 0.1)) EXPECT_EQ(radius, 1.9);
  for (const double radius : radii_on(sphere, points, 2.2, 0.1)) EXPECT_EQ(radius, kStep * 2.2);
}

// Both sides of a plate are disks, and so is what runs around its rim. Corners that jut out of a ball are no holes.
TEST(DiskRadii, OfAPlateDoNotDependOnItsThickness) {
  for (const double thickness : {0.1, 0.001}) {
    TriangleMesh plate = box(8);
    for (Vec3& v : plate.vertices) v.z *= thickness;
    std::vector<SurfaceSample> points;
    for (const double radius : radii_on(plate, points, 0.3, 0.1)) EXPECT_EQ(radius, 0.3);
  }
}

TEST(DiskRadii, AreNeverBelowTheLeast) {
  std::vector<SurfaceSample> points;
  const TriangleMesh mesh = tube(0.01, 1, 12);
  for (const double radius : radii_on(mesh, points, 1, 0.25)) EXPECT_NEAR(radius, 0.262144, 1e-12);
}

}  // namespace
}  // namespace bisector::test
