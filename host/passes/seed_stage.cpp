#include "host/passes/seed_stage.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/parallel.h"
#include "core/stopwatch.h"
#include "host/passes/packing.h"
#include "kernels/layout/elements.h"
#include "kernels/layout/push.h"
#include "voronoi/step_mass.h"

namespace bisector::host {
namespace {

constexpr double kFarthest = 1e12;  // coordinate on the device; beyond, squares of singles would overflow

}  // namespace

Precisions choose_precisions(const Device& device, Precision asked, bool double_rung) {
  const DeviceDescription& description = device.description();
  if (asked == Precision::double_ && !description.float64)
    throw DeviceError(description.name + " does not compute in double precision", Reason::no_double_precision);
  const bool is_double = asked == Precision::double_ || (asked == Precision::automatic && description.float64);
  return {is_double, !is_double && double_rung && description.float64};
}

SeedStage::SeedStage(std::shared_ptr<Device> opened, const Precisions& precisions, const VulkanOptions& options,
                     double scale, const Box& box, bool in_solid)
    : device_(std::move(opened)), double_(precisions.is_double), double_rung_(precisions.double_rung),
      source_(options.neighbours), box_(box), commands(*device_), scan(*device_), counters(*device_), seeds(*device_),
      neighbours(*device_, double_, in_solid ? kSolidLists : kSurfaceLists, options.capacities.wide), exact(in_solid) {
  counters.reserve(kCounters * sizeof(std::uint32_t));
  seeds.scale = scale;
}

bool SeedStage::within_reach(const std::vector<Vec3>& given) {
  constexpr std::size_t kChunk = 4096;
  std::vector<double> largest((given.size() + kChunk - 1) / kChunk, 0);
  parallel_chunks(given.size(), kChunk, [&](std::size_t c, std::size_t begin, std::size_t end) {
    double most = 0;
    for (std::size_t i = begin; i < end; ++i)
      for (int k = 0; k < 3; ++k) {
        const double coordinate = std::abs(given[i][k]);
        // What is not a number is out of reach.
        most = coordinate <= most ? most : coordinate;
      }
    largest[c] = most;
  });
  double most = 0;
  for (const Vec3& corner : {box_.lo, box_.hi})
    for (int k = 0; k < 3; ++k) most = std::max(most, std::abs(corner[k]));
  for (const double coordinate : largest) most = coordinate <= most ? most : coordinate;
  seeds.largest = most * seeds.scale;
  return seeds.largest < kFarthest;
}

void SeedStage::begin(const std::vector<Vec3>& given) {
  const Stopwatch watch;
  const bool follows = !delaunay() && seeds.follow(given);
  followed_ = follows && !renewed_;
  if (!follows) {
    seeds.sort(given);
    order_uploaded_ = false;
  }
  distinct_ = !follows;
  renewed_ = false;
  if (delaunay()) rings_.build(seeds.on_host(), NeighbourSource::delaunay);
  lists_seconds_ = watch.seconds();
}

void SeedStage::begin_resident(const std::function<std::vector<Vec3>()>& fetch) {
  if (seeds.count() < seeds.given_count()) {
    brought_back_ = fetch();
    return begin(brought_back_);
  }
  followed_ = !std::exchange(renewed_, false);
  distinct_ = false;
  seeds.take_resident(fetch);
  lists_seconds_ = 0;
}

void SeedStage::renew_slots(const std::vector<Vec3>& given) {
  if (seeds.follow(given)) return;
  seeds.sort(given);
  order_uploaded_ = false;
  renewed_ = true;
}

void SeedStage::record() {
  place_seeds();
  exact.begin(seeds, delaunay() ? &rings_ : nullptr);
  commands.fill(counters, 0, kCounters * sizeof(std::uint32_t), 0);
  neighbours.begin(commands, seeds);
  if (delaunay()) neighbours.upload_lists(commands, seeds, rings_);
  else neighbours.list_nearest(commands, seeds, counters);
}

bool SeedStage::keeps_slots(const Counters& counted) {
  if (distinct_ || !counted[kCoincident]) return true;
  seeds.sort(seeds.positions());
  followed_ = order_uploaded_ = false;
  distinct_ = true;
  return false;
}

// Positions are in the caller's order, so that the host reads and writes memory in order; the device puts them into
// slots.
void SeedStage::place_seeds() {
  const std::size_t n = seeds.count(), given_count = seeds.given_count();
  const bool as_doubles = given_as_doubles();
  seeds.residual = double_ ? 0 : residual_of(seeds.largest);
  seeds.given.reserve(given_bytes(given_count));
  seeds.order.reserve(n * sizeof(uint));
  seeds.words.reserve(n * point_words(double_) * (double_ ? sizeof(double) : sizeof(float)));
  seeds.doubles.reserve(double_rung_ ? n * sizeof(Vec3) : 0);
  seeds.ids.reserve(n * sizeof(SeedId));
  commands.phase(&DeviceSeconds::transfer);
  if (!seeds.are_resident()) upload_seeds();
  if (!order_uploaded_) commands.upload(seeds.order, 0, seeds.all_ids().data(), n * sizeof(Index));
  order_uploaded_ = true;
  commands.dispatch(
      kernel("place_seeds", as_doubles, {double_rung_}),
      {reads(seeds.given), reads(seeds.order), writes(seeds.words), writes(seeds.doubles), writes(seeds.ids)},
      CountPush{static_cast<uint>(n)}, n);
}

std::size_t SeedStage::given_bytes(std::size_t count) const {
  return count * (given_as_doubles() ? kGivenDoubleWords : kGivenSingleWords) * sizeof(uint);
}

void SeedStage::upload_seeds() {
  const std::vector<Vec3>& given = seeds.positions();
  const bool as_doubles = given_as_doubles();
  const std::size_t bytes = given_bytes(1);
  commands.upload_items(seeds.given, bytes, given.size(), [&](std::byte* at, std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i, at += bytes) {
      const Vec3 p = seeds.scale * given[i];
      if (as_doubles) {
        std::memcpy(at, &p, sizeof p);
        continue;
      }
      std::array<uint, kGivenSingleWords> packed;
      for (int k = 0; k < 3; ++k) {
        const auto [high, low] = split(p[k]);
        packed[static_cast<std::size_t>(k)] = std::bit_cast<uint>(high);
        packed[static_cast<std::size_t>(3 + k)] = std::bit_cast<uint>(low);
        packed[static_cast<std::size_t>(6 + k)] = low_word(given[i][k], seeds.scale, i);
      }
      std::memcpy(at, packed.data(), sizeof packed);
    }
  });
}

Counters SeedStage::run_counted() {
  Counters counted{};
  commands.download(counters, kOverflow * sizeof(uint), counted.data() + kOverflow,
                    (kCounters - kOverflow) * sizeof(uint));
  commands.run();
  return counted;
}

BackendDescription SeedStage::description() const {
  const DeviceDescription& device = device_->description();
  return {device.name, device.kind, double_ ? "double" : "single", ""};
}

void SeedStage::complete_step_masses(CellMoments& moments) {
  if (std::none_of(moments.step_mass.begin(), moments.step_mass.end(), [](double mass) { return mass < 0; })) return;
  if (delaunay()) return bisector::set_step_masses(seeds.on_host(), rings_, moments);
  bisector::complete_step_masses(
      seeds.on_host(), [&]() -> const Neighbours& { return exact.neighbours(); }, moments);
}

}  // namespace bisector::host
