#include "host/passes/neighbour_pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "host/passes/packing.h"
#include "kernels/layout/pairs.h"
#include "kernels/layout/push.h"

namespace bisector::host {
namespace {

constexpr std::uint32_t kLeastEntries = 12;  // of a list, for most cells to be certified by theirs
// Wide lists that there is memory for at first: some, and of seeds on surfaces, of which 0.2 % need one, a share.
constexpr std::size_t kLeastWide = 4096, kSeedsPerWide = 64;
// A squared radius beyond kInfinity of kernels/real.glsl: all seeds are listed.
constexpr float kUnlimited = 2e37f;
// Relative, by which squared radii are made smaller, for rounding them to single precision may make none larger.
constexpr double kRadiusMargin = 1e-6;
constexpr std::size_t kWord = sizeof(std::uint32_t);
// Through the stack of a wider list. llvmpipe would end loops of more; elsewhere the search always ends before, as
// whether it does must not depend on the order in which invocations push boxes.
constexpr std::uint32_t kSoftwareRounds = 96, kMostRounds = 1u << 20;

}  // namespace

NeighbourPass::NeighbourPass(Device& device, bool is_double, const ListSizes& sizes, std::size_t wide)
    : device_(device), double_(is_double), sizes_(sizes), tree_(device), info_(device), lists_(device),
      wide_lists_(device), targets_(device), width_(device), asked_wide_(wide) {}

void NeighbourPass::begin(Commands& commands, const DeviceSeeds& seeds) {
  const std::size_t n = seeds.count();
  tree_.plan(n);
  const std::size_t range = device_.limits().storage_range / kWord;
  most_ = static_cast<std::uint32_t>(std::min<std::size_t>(sizes_.most, range / n));
  if (most_ < kLeastEntries)
    throw DeviceError(fmt::format("{}: {} seeds are more than its buffers hold ({} bytes each)",
                                  device_.description().name, n, device_.limits().storage_range));
  lists_.reserve(n * most_ * kWord);
  info_.reserve(n * sizeof(ListInfo));
  const std::size_t expected = asked_wide_ ? asked_wide_ : std::max(kLeastWide, n / kSeedsPerWide) * sizes_.wide;
  wide_capacity_ =
      std::min({std::max(expected, most_wanted_ + most_wanted_ / 2), n * (sizes_.wide + kWidestList), range});
  may_grow_ = wide_capacity_ < range;
  wide_lists_.reserve(wide_capacity_ * kWord);
  targets_.reserve(2 * n * kWord);
  width_.reserve(n * kWord);
  commands.phase(&DeviceSeconds::grid);
  commands.fill(width_, 0, n * kWord, 0);
  tree_.record(commands, seeds, double_);
}

void NeighbourPass::list_nearest(Commands& commands, const DeviceSeeds& seeds, const Buffer& counters) {
  commands.phase(&DeviceSeconds::neighbours);
  commands.dispatch(
      kernel("neighbours", double_, {most_, std::bit_ceil(most_), sizes_.opened}),
      {reads(seeds.words), reads(seeds.ids), reads(tree_.boxes()), updates(lists_), writes(info_), updates(counters)},
      tree_.push<NeighboursPush>(seeds), seeds.count());
}

void NeighbourPass::choose_targets(Commands& commands, const Buffer& flagged, std::size_t first_flagged,
                                   const Buffer& pairs, const Buffer& counters) {
  commands.phase(&DeviceSeconds::neighbours);
  commands.dispatch_indirect(
      {"wide_targets", {}},
      {reads(flagged), reads(pairs), updates(width_), writes(targets_), updates(counters), reads(info_)},
      WideTargetsPush{static_cast<uint>(first_flagged)}, counters, (kGroups + 3 * kWorkShort) * kWord);
}

void NeighbourPass::widen(Commands& commands, const DeviceSeeds& seeds, const Buffer& counters) {
  WideListsPush push = tree_.push<WideListsPush>(seeds);
  push.wide_capacity = static_cast<uint>(wide_capacity_);
  push.may_grow = may_grow_;
  const std::uint32_t rounds = device_.description().kind == "software" ? kSoftwareRounds : kMostRounds;
  commands.dispatch_indirect(kernel("wide_lists", double_, {sizes_.wide, rounds}),
                             {reads(seeds.words), reads(seeds.ids), reads(tree_.boxes()), writes(wide_lists_),
                              updates(info_), updates(counters), reads(targets_)},
                             push, counters, (kGroups + 3 * kWorkTargets) * kWord);
}

void NeighbourPass::upload_lists(Commands& commands, const DeviceSeeds& seeds, const Neighbours& neighbours) {
  const std::size_t n = seeds.count();
  std::vector<ListInfo> info;
  std::vector<Index> values;
  info.reserve(n);
  for (Index slot = 0; slot < n; ++slot) {
    const NeighbourList list = neighbours.list(slot);
    const double radius = list.radius * seeds.scale;
    const bool unlimited = list.radius == std::numeric_limits<double>::infinity();
    const float squared = unlimited ? kUnlimited : static_cast<float>(radius * radius * (1 - kRadiusMargin));
    info.push_back({static_cast<uint>(values.size()), static_cast<uint>(list.end - list.begin),
                    std::bit_cast<uint>(squared), kListFirst});
    values.insert(values.end(), list.begin, list.end);
  }
  commands.phase(&DeviceSeconds::transfer);
  upload(commands, info_, info);
  upload(commands, lists_, values);
}

}  // namespace bisector::host
