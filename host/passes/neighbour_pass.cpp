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
constexpr std::size_t kLeastTargets = 4096, kSeedsPerTarget = 64;
// A squared radius beyond kInfinity of kernels/real.glsl: all seeds are listed.
constexpr float kUnlimited = 2e37f;
// Relative, by which squared radii are made smaller, for rounding them to single precision may make none larger.
constexpr double kRadiusMargin = 1e-6;
constexpr std::size_t kWord = sizeof(std::uint32_t);

}  // namespace

NeighbourPass::NeighbourPass(Device& device, bool is_double, const ListSizes& sizes)
    : device_(device), double_(is_double), sizes_(sizes), tree_(device), info_(device), lists_(device),
      wide_lists_(device), targets_(device), is_target_(device) {}

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
  const std::size_t wanted = std::max({kLeastTargets, n / kSeedsPerTarget, most_wanted_ + most_wanted_ / 2});
  target_capacity_ = std::min({wanted, std::max(n, kLeastTargets), range / sizes_.wide_most});
  wide_lists_.reserve(target_capacity_ * sizes_.wide_most * kWord);
  targets_.reserve(target_capacity_ * kWord);
  is_target_.reserve(n * kWord);
  commands.phase(&DeviceSeconds::grid);
  commands.fill(is_target_, 0, n * kWord, 0);
  tree_.record(commands, seeds, double_);
}

void NeighbourPass::list_nearest(Commands& commands, const DeviceSeeds& seeds, const Buffer& counters) {
  commands.phase(&DeviceSeconds::neighbours);
  commands.dispatch(kernel("neighbours", double_, {most_, false, sizes_.opened}),
                    {reads(seeds.words), reads(seeds.ids), reads(tree_.boxes()), writes(lists_), writes(info_),
                     updates(counters), reads(targets_)},
                    tree_.push<NeighboursPush>(seeds), seeds.count());
}

void NeighbourPass::choose_targets(Commands& commands, const Buffer& flagged, std::size_t first_flagged,
                                   const Buffer& pairs, const Buffer& counters) {
  commands.phase(&DeviceSeconds::neighbours);
  const WideTargetsPush push{static_cast<uint>(first_flagged), static_cast<uint>(target_capacity_)};
  commands.dispatch_indirect({"wide_targets", {}},
                             {reads(flagged), reads(pairs), updates(is_target_), writes(targets_), updates(counters)},
                             push, counters, (kGroups + 3 * kWorkShort) * kWord);
}

void NeighbourPass::widen(Commands& commands, const DeviceSeeds& seeds, const Buffer& counters) {
  commands.dispatch_indirect(kernel("neighbours", double_, {sizes_.wide_most, true, sizes_.wide_opened}),
                             {reads(seeds.words), reads(seeds.ids), reads(tree_.boxes()), writes(wide_lists_),
                              writes(info_), updates(counters), reads(targets_)},
                             tree_.push<NeighboursPush>(seeds), counters, (kGroups + 3 * kWorkTargets) * kWord);
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
    info.push_back(
        {static_cast<uint>(values.size()), static_cast<uint>(list.end - list.begin), std::bit_cast<uint>(squared), 0});
    values.insert(values.end(), list.begin, list.end);
  }
  commands.phase(&DeviceSeconds::transfer);
  upload(commands, info_, info);
  upload(commands, lists_, values);
}

}  // namespace bisector::host
