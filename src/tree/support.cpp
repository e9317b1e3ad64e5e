#include "tree/support.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "tree/polyline.h"

namespace bisector {
namespace {

constexpr double kReach = 2;               // of the points asked, along the axis in radii
constexpr double kLeastPoints = 12;        // that a radius rests on
constexpr int kSectors = 12;               // around the axis
constexpr int kLeastSectors = 4;           // with points in them: a third of the way round, as seen from one side
constexpr double kLargestResidual = 0.25;  // off the surface, rms, in radii; of thin branches, where the noise is more,
constexpr double kNoisyResidual = 0.42;    // as long as they are
constexpr double kNoise = 1.3;             // off the surface by so many times the noise at most
constexpr double kOutlier = 0.6;           // off the surface in radii: points of something else
constexpr double kMostOutliers = 0.3;      // of the points asked

struct Survey {
  double points = 0, squares = 0, outliers = 0;
  std::uint32_t sectors = 0;
};

// Frames that turn as little as they can along the axis, for sectors that mean the same at neighbouring points.
std::vector<std::array<Vec3, 2>> frames(const std::vector<Vec3>& axis) {
  std::vector<std::array<Vec3, 2>> result;
  Vec3 x{1, 0, 0};
  for (std::size_t k = 0; k < axis.size(); ++k) {
    const Vec3 z = unit(axis[std::min(k + 1, axis.size() - 1)] - axis[k > 0 ? k - 1 : 0]);
    Vec3 across = x - dot(x, z) * z;
    if (!(norm(across) > 0.1)) across = cross(z, std::abs(z.z) < 0.7 ? Vec3{0, 0, 1} : Vec3{1, 0, 0});
    x = unit(across);
    result.push_back({x, cross(z, x)});
  }
  return result;
}

}  // namespace

std::vector<char> supported_radii(const std::vector<Vec3>& points, const Limb& limb, double noise) {
  const std::size_t m = limb.axis.size();
  const auto frame = frames(limb.axis);
  std::vector<double> along(m, 0);
  for (std::size_t k = 1; k < m; ++k) along[k] = along[k - 1] + norm(limb.axis[k] - limb.axis[k - 1]);
  std::vector<Survey> surveys(m);
  for (const Index i : limb.points) {
    const PolylineFoot foot = nearest_on_polyline(limb.axis, points[i]);
    const double radius = value_at(limb.radii, foot);
    const double place = along[foot.segment] + foot.t * (along[foot.segment + 1] - along[foot.segment]);
    const bool beyond = (foot.segment == 0 && foot.t == 0) || (foot.segment + 2 == m && foot.t == 1);
    if (beyond || !(radius > 0)) continue;
    const Vec3 out = points[i] - foot.point;
    const auto& [x, y] = frame[foot.segment];
    const double angle = std::atan2(dot(out, y), dot(out, x)) / (2 * std::numbers::pi) + 0.5;
    const auto sector = std::min(static_cast<int>(angle * kSectors), kSectors - 1);
    const double off = (foot.distance - radius) / radius;
    const auto ask = [&](Survey& s) {
      ++s.points;
      if (std::abs(off) > kOutlier) {
        ++s.outliers;
        return;
      }
      s.squares += off * off;
      s.sectors |= std::uint32_t{1} << sector;
    };
    for (std::size_t k = foot.segment + 1; k-- > 0 && place - along[k] <= kReach * radius;) ask(surveys[k]);
    for (std::size_t k = foot.segment + 1; k < m && along[k] - place <= kReach * radius; ++k) ask(surveys[k]);
  }
  std::vector<char> result(m, 0);
  for (std::size_t k = 0; k < m; ++k) {
    const Survey& s = surveys[k];
    const double near = s.points - s.outliers;
    const double most = std::clamp(kNoise * noise / limb.radii[k], kLargestResidual, kNoisyResidual);
    result[k] = near >= kLeastPoints && s.outliers <= kMostOutliers * s.points &&
                std::popcount(s.sectors) >= kLeastSectors && s.squares <= most * most * near;
  }
  return result;
}

double surface_noise(const std::vector<Vec3>& points, const std::vector<Limb>& limbs) {
  std::vector<double> off;
  for (const Limb& limb : limbs)
    for (const Index i : limb.points) {
      const PolylineFoot foot = nearest_on_polyline(limb.axis, points[i]);
      if (!limb.fitted[foot.segment] || !limb.fitted[foot.segment + 1]) continue;
      const double radius = value_at(limb.radii, foot), distance = std::abs(foot.distance - radius);
      if (distance < kOutlier * radius) off.push_back(distance);
    }
  return 1.4826 * quantile(std::move(off), 0.5);
}

}  // namespace bisector
