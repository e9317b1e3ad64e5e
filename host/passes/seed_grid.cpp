#include "host/passes/seed_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "host/passes/packing.h"

namespace bisector::host {
namespace {

constexpr std::size_t kSpacingSamples = 512;
constexpr double kMostCells = 1e5;  // along one axis

}  // namespace

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

void SeedGrid::plan(const SortedSeeds& seeds, double cell, double scale, Scan& scan) {
  const std::size_t n = seeds.x.size(), buckets = std::bit_ceil(std::max<std::size_t>(64, 2 * n));
  const double least = seeds.extent > 0 ? seeds.extent / kMostCells : 1 / scale;
  const double size = std::max(cell, least) * scale;
  const Box box = bounding_box(seeds.x);
  for (int k = 0; k < 3; ++k)
    push_.grid_lower[static_cast<std::size_t>(k)] = static_cast<float>(box.lo[k] * scale - size);
  push_.grid_inverse = static_cast<float>(1 / size);
  push_.bucket_mask = static_cast<std::uint32_t>(buckets - 1);
  push_.seed_count = static_cast<std::uint32_t>(n);
  ends_.reserve(buckets * sizeof(std::uint32_t));
  slots_.reserve(n * sizeof(std::uint32_t));
  scan.reserve(buckets);
}

void SeedGrid::record(Commands& commands, const Buffer& seeds, bool is_double, Scan& scan) {
  const std::size_t buckets = std::size_t{push_.bucket_mask} + 1;
  commands.fill(ends_, 0, buckets * sizeof(std::uint32_t), 0);
  commands.dispatch(kernel("grid_count", is_double), {reads(seeds), updates(ends_)}, push_, push_.seed_count);
  scan.record(commands, ends_, buckets);
  commands.dispatch(kernel("grid_scatter", is_double), {reads(seeds), updates(ends_), writes(slots_)}, push_,
                    push_.seed_count);
}

}  // namespace bisector::host
