#include "host/passes/seeds.h"

#include <algorithm>
#include <utility>

#include "core/parallel.h"

namespace bisector::host {
namespace {

constexpr std::size_t kSamples = 4096;  // of the steps from slot to slot
// By what factor these steps may grow before slots are given anew: the boxes of the tree grow with them.
constexpr double kMostGrowth = 1.5;

}  // namespace

// The median for a sample.
double DeviceSeeds::step_between_slots(const std::vector<Vec3>& seeds) const {
  const std::size_t n = count(), samples = std::min(n - 1, kSamples);
  if (samples == 0) return 0;
  std::vector<double> squares(samples);
  for (std::size_t k = 0; k < samples; ++k) {
    const std::size_t s = k * (n - 1) / samples;
    squares[k] = norm2(seeds[sorted_.id[s + 1]] - seeds[sorted_.id[s]]);
  }
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(samples / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return *middle;
}

void DeviceSeeds::sort(const std::vector<Vec3>& seeds) {
  seeds_ = &seeds;
  fetch_ = nullptr;
  sorted_ = sort_seeds(seeds);
  on_host_ = true;
  sorted_step_ = step_between_slots(seeds);
}

bool DeviceSeeds::follow(const std::vector<Vec3>& seeds) {
  if (seeds.size() != given_count() || count() != given_count()) return false;
  seeds_ = &seeds;
  fetch_ = nullptr;
  on_host_ = false;
  return step_between_slots(seeds) <= kMostGrowth * kMostGrowth * sorted_step_;
}

void DeviceSeeds::take_resident(std::function<std::vector<Vec3>()> fetch) {
  seeds_ = nullptr;
  fetch_ = std::move(fetch);
  on_host_ = false;
}

const std::vector<Vec3>& DeviceSeeds::positions() const {
  if (!seeds_) {
    fetched_ = fetch_();
    seeds_ = &fetched_;
  }
  return *seeds_;
}

const SortedSeeds& DeviceSeeds::on_host() const {
  if (!on_host_) {
    const std::vector<Vec3>& seeds = positions();
    parallel_each(count(), [&](std::size_t s) { sorted_.x[s] = seeds[sorted_.id[s]]; });
    sorted_.extent = bounding_box(sorted_.x).diagonal();
    on_host_ = true;
  }
  return sorted_;
}

}  // namespace bisector::host
