#include "tree/cylinder.h"

#include <CGAL/Min_sphere_of_points_d_traits_2.h>
#include <CGAL/Min_sphere_of_spheres_d.h>
#include <CGAL/Simple_cartesian.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace bisector {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using MinCircle = CGAL::Min_sphere_of_spheres_d<CGAL::Min_sphere_of_points_d_traits_2<Kernel, double>>;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSteps = 8;       // of Gauss-Newton
constexpr double kLargest = 2;  // radius, in bounding radii

Vec3 to_vec3(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Vector3d mean(const std::vector<Vec3>& points) {
  Vec3 sum;
  for (const Vec3& p : points) sum += p;
  sum *= 1 / static_cast<double>(points.size());
  return {sum.x, sum.y, sum.z};
}

Vector3d principal_direction(const std::vector<Vec3>& points, const Vector3d& centre) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& p : points) {
    const Vector3d d = Vector3d(p.x, p.y, p.z) - centre;
    spread += d * d.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
}

struct Circle {
  Vector2d centre = Vector2d::Zero();
  double radius = 0;
};

Circle smallest_circle(const std::vector<Vector2d>& points) {
  std::vector<Kernel::Point_2> sites;
  sites.reserve(points.size());
  for (const Vector2d& p : points) sites.emplace_back(p.x(), p.y());
  MinCircle circle(sites.begin(), sites.end());
  const double* centre = circle.center_cartesian_begin();
  return {{centre[0], centre[1]}, circle.radius()};
}

// Of distances from the points, from the bounding circle on. Steps that lead far away mean a straight row of points.
Circle least_squares_circle(const std::vector<Vector2d>& points, const Circle& bounding) {
  Circle circle = bounding;
  const double n = static_cast<double>(points.size());
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    for (const Vector2d& p : points) {
      const Vector2d d = p - circle.centre;
      const double distance = d.norm();
      if (distance <= 1e-12 * bounding.radius) continue;
      const Vector3d row(d.x() / distance, d.y() / distance, 1);
      normal += row * row.transpose();
      right += (distance - circle.radius) * row;
    }
    normal.diagonal().head<2>().array() += 1e-3 * n;
    const Vector3d change = normal.ldlt().solve(right);
    circle.centre += change.head<2>();
    circle.radius += change.z();
    if (!(circle.radius <= kLargest * bounding.radius && circle.radius > 0)) {
      circle.radius = std::clamp(circle.radius, 0.0, kLargest * bounding.radius);
      break;
    }
    if (change.norm() <= 1e-6 * bounding.radius) break;
  }
  return circle;
}

}  // namespace

BranchCylinder fit_cylinder(const std::vector<Vec3>& points, Vec3 axis) {
  BranchCylinder cylinder;
  if (points.empty()) return cylinder;
  const Vector3d centre = mean(points);
  Vector3d z(axis.x, axis.y, axis.z);
  if (!(z.norm() > 0)) z = principal_direction(points, centre);
  z.normalize();
  const Vector3d x = z.unitOrthogonal(), y = z.cross(x);

  std::vector<Vector2d> projected(points.size());
  double low = 0, high = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d d = Vector3d(points[i].x, points[i].y, points[i].z) - centre;
    projected[i] = {d.dot(x), d.dot(y)};
    low = std::min(low, d.dot(z));
    high = std::max(high, d.dot(z));
  }
  const Circle bounding = smallest_circle(projected);
  const Circle circle = least_squares_circle(projected, bounding);
  double squares = 0;
  for (const Vector2d& p : projected) {
    const double off = (p - circle.centre).norm() - circle.radius;
    squares += off * off;
  }
  cylinder.centre = to_vec3(centre + circle.centre.x() * x + circle.centre.y() * y + 0.5 * (low + high) * z);
  cylinder.axis = to_vec3(z);
  cylinder.radius = circle.radius;
  cylinder.bounding_radius = bounding.radius;
  cylinder.length = high - low;
  cylinder.rms = std::sqrt(squares / static_cast<double>(points.size()));
  return cylinder;
}

}  // namespace bisector
