#include "host/passes/neighbour_pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "host/passes/counters.h"
#include "host/passes/packing.h"

namespace bisector::host {
namespace {

constexpr std::uint32_t kLeast = 12;
constexpr std::size_t kLeastTargets = 4096;
constexpr float kUnlimited = 2e37f;                   // beyond kInfinity of kernels/real.glsl
constexpr std::size_t kWord = sizeof(std::uint32_t);

struct SearchPush {
  GridPush grid;
  float residual;
  std::uint32_t two, first_target, target_room;
};
static_assert(sizeof(SearchPush) == 40);

struct TargetsPush {
  std::uint32_t count, room;
};

}  // namespace

NeighbourPass::NeighbourPass(Device& device, bool is_double, const ListSizes& sizes)
    : device_(device), double_(is_double), sizes_(sizes), grid_(device), wide_grid_(device), info_(device), lists_(device),
      wide_lists_(device), targets_(device), is_target_(device) {}

void NeighbourPass::begin(Commands& commands, const DeviceSeeds& seeds, double spacing, Scan& scan) {
  const std::size_t n = seeds.count();
  grid_.plan(seeds.sorted, sizes_.cell * spacing, seeds.scale, scan);
  wide_grid_.plan(seeds.sorted, sizes_.wide_cell * spacing, seeds.scale, scan);
  wide_grid_built_ = false;
  const std::size_t range = device_.limits().storage_range / kWord;
  most_ = static_cast<std::uint32_t>(std::min<std::size_t>(sizes_.most, range / n));
  if (most_ < kLeast)
    throw DeviceError(fmt::format("{}: {} seeds are more than its buffers hold ({} bytes each); use --device cpu",
                                  device_.description().name, n, device_.limits().storage_range));
  lists_.reserve(n * most_ * kWord);
  info_.reserve(n * 4 * kWord);
  target_room_ = std::min(std::max(kLeastTargets, static_cast<std::size_t>(sizes_.wide_share * static_cast<double>(n))), range / sizes_.wide_most);
  wide_lists_.reserve(target_room_ * sizes_.wide_most * kWord);
  targets_.reserve(target_room_ * kWord);
  is_target_.reserve(n * kWord);
  commands.phase(Phase::grid);
  commands.fill(is_target_, 0, n * kWord, 0);
  grid_.record(commands, seeds.words, double_, scan);
}

void NeighbourPass::list_nearest(Commands& commands, const DeviceSeeds& seeds, const Buffer& counters) {
  commands.phase(Phase::neighbours);
  search(commands, seeds, grid_, counters, false, 0, seeds.count());
}

void NeighbourPass::search(Commands& commands, const DeviceSeeds& seeds, const SeedGrid& grid, const Buffer& counters,
                           bool targets, std::size_t first_target, std::size_t items) {
  const SearchPush push{grid.push(), seeds.residual, 2, static_cast<std::uint32_t>(first_target),
                        static_cast<std::uint32_t>(target_room_)};
  commands.dispatch(kernel("neighbours", double_, {targets ? sizes_.wide_most : most_, targets, targets ? sizes_.wide_examined : sizes_.examined}),
                    {reads(seeds.words), reads(seeds.ids), reads(grid.ends()), reads(grid.slots()),
                     writes(targets ? wide_lists_ : lists_), writes(info_), updates(counters), reads(targets_)},
                    push, items);
}

void NeighbourPass::upload_lists(Commands& commands, const DeviceSeeds& seeds, const Neighbours& neighbours) {
  const std::size_t n = seeds.count();
  std::vector<std::uint32_t> info(4 * n), values;
  for (Index slot = 0; slot < n; ++slot) {
    const NeighbourList list = neighbours.list(slot);
    info[4 * slot] = static_cast<std::uint32_t>(values.size());
    info[4 * slot + 1] = static_cast<std::uint32_t>(list.end - list.begin);
    values.insert(values.end(), list.begin, list.end);
    const double radius = list.radius * seeds.scale;
    const bool unlimited = list.radius == std::numeric_limits<double>::infinity();
    info[4 * slot + 2] =
        std::bit_cast<std::uint32_t>(unlimited ? kUnlimited : static_cast<float>(radius * radius * (1 - 1e-6)));
  }
  commands.phase(Phase::transfer);
  upload(commands, info_, info);
  upload(commands, lists_, values);
}

void NeighbourPass::widen(Commands& commands, const DeviceSeeds& seeds, Scan& scan, const Buffer& flagged,
                          std::size_t flagged_count, const Buffer& pairs, std::size_t targets, const Buffer& counters) {
  commands.phase(Phase::neighbours);
  if (!wide_grid_built_) wide_grid_.record(commands, seeds.words, double_, scan);
  wide_grid_built_ = true;
  const TargetsPush push{static_cast<std::uint32_t>(flagged_count), static_cast<std::uint32_t>(target_room_)};
  commands.dispatch({"targets", {}},
                    {reads(flagged), reads(pairs), updates(is_target_), writes(targets_), updates(counters)}, push,
                    flagged_count);
  const std::size_t first = std::min(targets, target_room_);
  search(commands, seeds, wide_grid_, counters, true, first, std::min(flagged_count, target_room_ - first));
}

}  // namespace bisector::host
