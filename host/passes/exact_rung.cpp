#include "host/passes/exact_rung.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "voronoi/owner.h"

namespace bisector::host {
namespace {

constexpr double kFirstRadius = 3;  // in typical spacings; the first growth multiplies it
constexpr std::size_t kSpacingSamples = 512;

// About how far apart seeds lie, if they lie on a surface, or else in a solid: the median for a sample. It depends on
// the seeds alone, not on what was computed before.
double typical_spacing(const std::vector<Vec3>& seeds, bool in_solid) {
  const std::size_t n = seeds.size(), m = std::min(n, kSpacingSamples);
  std::vector<double> nearest(m, std::numeric_limits<double>::infinity());
  parallel_each(
      m,
      [&](std::size_t a) {
        const Vec3 x = seeds[a * n / m];
        for (std::size_t b = 0; b < m; ++b) {
          const double squared = norm2(seeds[b * n / m] - x);
          if (squared > 0) nearest[a] = std::min(nearest[a], squared);
        }
      },
      64);
  const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(m / 2);
  std::nth_element(nearest.begin(), middle, nearest.end());
  if (std::isinf(*middle)) return 0;
  const double share = static_cast<double>(m) / static_cast<double>(n);
  // In a random set in the plane the nearest neighbour is at half the spacing, and in space at 0.55 of it.
  return in_solid ? 1.8 * std::sqrt(*middle) * std::cbrt(share) : 2 * std::sqrt(*middle * share);
}

}  // namespace

void ExactRung::begin(const DeviceSeeds& seeds, const Neighbours* neighbours) {
  seeds_ = &seeds;
  given_ = neighbours;
  built_ = false;
}

const Neighbours& ExactRung::neighbours() {
  if (given_) return *given_;
  if (!built_) {
    own_.build_on_demand(seeds_->on_host(), kFirstRadius * typical_spacing(seeds_->positions(), in_solid_));
    built_ = true;
  }
  return own_;
}

std::vector<Index> ExactRung::owners(const std::vector<Vec3>& points) {
  const Neighbours& near = neighbours();
  const SortedSeeds& seeds = seeds_->on_host();
  std::vector<Index> slots(points.size());
  parallel_each(
      points.size(), [&](std::size_t k) { slots[k] = find_owner(seeds, near, points[k], near.nearest(points[k])); },
      64);
  return slots;
}

}  // namespace bisector::host
