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
constexpr std::size_t kLeastTargets = 4096;  // wide lists that there is memory for, however few the seeds are
// A squared radius beyond kInfinity of kernels/real.glsl: all seeds are listed.
constexpr float kUnlimited = 2e37f;
// Relative, by which squared radii are made smaller, for rounding them to single precision may make none larger.
constexpr double kRadiusMargin = 1e-6;
constexpr std::size_t kWord = sizeof(std::uint32_t);

}  // namespace

NeighbourPass::NeighbourPass(Device& device, bool is_double, const ListSizes& sizes)
    : device_(device), double_(is_double), sizes_(sizes), grid_(device), wide_grid_(device), info_(device),
      lists_(device), wide_lists_(device), targets_(device), is_target_(device) {}

void NeighbourPass::begin(Commands& commands, const DeviceSeeds& seeds, double spacing, Scan& scan) {
  const std::size_t n = seeds.count();
  grid_.plan(seeds.sorted, sizes_.cell * spacing, seeds.scale, scan);
  wide_grid_.plan(seeds.sorted, sizes_.wide_cell * spacing, seeds.scale, scan);
  wide_grid_built_ = false;
  const std::size_t range = device_.limits().storage_range / kWord;
  most_ = static_cast<std::uint32_t>(std::min<std::size_t>(sizes_.most, range / n));
  if (most_ < kLeastEntries)
    throw DeviceError(fmt::format("{}: {} seeds are more than its buffers hold ({} bytes each)",
                                  device_.description().name, n, device_.limits().storage_range));
  lists_.reserve(n * most_ * kWord);
  info_.reserve(n * sizeof(ListInfo));
  const std::size_t wanted =
      std::max(kLeastTargets, static_cast<std::size_t>(sizes_.wide_share * static_cast<double>(n)));
  target_capacity_ = std::min(wanted, range / sizes_.wide_most);
  wide_lists_.reserve(target_capacity_ * sizes_.wide_most * kWord);
  targets_.reserve(target_capacity_ * kWord);
  is_target_.reserve(n * kWord);
  commands.phase(&DeviceSeconds::grid);
  commands.fill(is_target_, 0, n * kWord, 0);
  grid_.record(commands, seeds.words, double_, scan);
}

void NeighbourPass::list_nearest(Commands& commands, const DeviceSeeds& seeds, const Buffer& counters) {
  commands.phase(&DeviceSeconds::neighbours);
  search(commands, seeds, grid_, counters, false, 0, seeds.count());
}

void NeighbourPass::search(Commands& commands, const DeviceSeeds& seeds, const SeedGrid& grid, const Buffer& counters,
                           bool targets, std::size_t first_target, std::size_t items) {
  const GridPush& at = grid.push();
  const NeighboursPush push{at.grid_lower,
                            at.grid_inverse,
                            at.bucket_mask,
                            at.seed_count,
                            seeds.residual,
                            kTwo,
                            static_cast<uint>(first_target),
                            static_cast<uint>(target_capacity_)};
  const uint most = targets ? sizes_.wide_most : most_, examined = targets ? sizes_.wide_examined : sizes_.examined;
  commands.dispatch(kernel("neighbours", double_, {most, targets, examined}),
                    {reads(seeds.words), reads(seeds.ids), reads(grid.ends()), reads(grid.slots()),
                     writes(targets ? wide_lists_ : lists_), writes(info_), updates(counters), reads(targets_)},
                    push, items);
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

void NeighbourPass::widen(Commands& commands, const DeviceSeeds& seeds, Scan& scan, const Buffer& flagged,
                          std::size_t flagged_count, const Buffer& pairs, std::size_t targets, const Buffer& counters) {
  commands.phase(&DeviceSeconds::neighbours);
  if (!wide_grid_built_) wide_grid_.record(commands, seeds.words, double_, scan);
  wide_grid_built_ = true;
  const WideTargetsPush push{static_cast<uint>(flagged_count), static_cast<uint>(target_capacity_)};
  commands.dispatch({"wide_targets", {}},
                    {reads(flagged), reads(pairs), updates(is_target_), writes(targets_), updates(counters)}, push,
                    flagged_count);
  const std::size_t first = std::min(targets, target_capacity_);
  search(commands, seeds, wide_grid_, counters, true, first, std::min(flagged_count, target_capacity_ - first));
}

}  // namespace bisector::host
