#include "segment/meeting_point.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "segment/surface_normal.h"

namespace bisector {
namespace {

// A surface is trusted within this share of the spread at least, so that the weights stay within what doubles hold.
constexpr double kLeastError = 1e-6;
constexpr int kSteps = 10;
constexpr double kSettled = 1e-12;  // a step of so many spreads

}  // namespace

Vec3 meeting_point(const Vec3& p, const std::vector<MeetingSurface>& surfaces, double spread) {
  if (!(spread > 0)) return p;
  Vec3 x = p;
  for (int k = 0; k < kSteps; ++k) {
    // In units of the spread: minimise |y - p|^2 + sum of ((y - foot) . n / error)^2.
    const Vec3 back = (1 / spread) * (p - x);
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b(back.x, back.y, back.z);
    for (const MeetingSurface& s : surfaces) {
      const Vec3 foot = foot_point(*s.surface, x), normal = surface_normal(*s.surface, foot);
      const double error = std::max(s.error / spread, kLeastError);
      const Eigen::Vector3d n(normal.x, normal.y, normal.z);
      a += n * n.transpose() / (error * error);
      b += n * (dot(normal, foot - x) / (spread * error * error));
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(a);
    const Eigen::Vector3d along = solver.eigenvectors().transpose() * b;
    const Eigen::Vector3d weighted = along.array() / (solver.eigenvalues().array().max(0) + 1);
    const Eigen::Vector3d step = solver.eigenvectors() * weighted;
    x += spread * Vec3{step.x(), step.y(), step.z()};
    if (!(step.norm() > kSettled)) break;
  }
  return x;
}

}  // namespace bisector
