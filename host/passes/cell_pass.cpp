#include "host/passes/cell_pass.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/parallel.h"
#include "host/passes/packing.h"
#include "kernels/layout/push.h"
#include "kernels/layout/sizes.h"

namespace bisector::host {
namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);

uint word(std::size_t n) { return static_cast<uint>(n); }

}  // namespace

CellPass::CellPass(Device& device, bool is_double, bool is_solid)
    : device_(device), double_(is_double), solid_(is_solid), place_of_(device), by_place_(device),
      begins_(device), items_{Buffer(device), Buffer(device)},
      digit_counts_(device), block_begins_{Buffer(device), Buffer(device)}, sums_{Buffer(device), Buffer(device)},
      sorted_places_(device), cells_(device) {}

void CellPass::set_elements(Commands& commands, const std::vector<Index>& places, std::size_t count) {
  places_ = count;
  upload(commands, place_of_, places);
}

void CellPass::sort(Commands& commands, std::size_t cells, Scan& scan, const PairStore& store) {
  by_place_.reserve((places_ + 1) * kWord);
  begins_.reserve((cells + 1) * kWord);
  for (Buffer& items : items_) items.reserve(store.count * sizeof(SortItem));
  scan.reserve(std::max(places_, cells) + 1);
  commands.phase(&DeviceSeconds::sort);
  commands.fill(by_place_, 0, (places_ + 1) * kWord, 0);
  commands.fill(begins_, 0, (cells + 1) * kWord, 0);
  const CountPush pairs{word(store.count)};
  commands.dispatch({"count_pairs", {}},
                    {reads(store.pairs), reads(store.status), reads(place_of_), updates(by_place_), updates(begins_)},
                    pairs, store.count);
  scan.record(commands, by_place_, places_ + 1);
  scan.record(commands, begins_, cells + 1);
  commands.dispatch({"scatter_pairs", {}},
                    {reads(store.pairs), reads(store.status), reads(place_of_), updates(by_place_), writes(items_[0])},
                    pairs, store.count);
  std::vector<std::uint32_t>& begins = begins_of_cells_;
  begins.resize(cells + 1);
  commands.download(begins_, 0, begins.data(), begins.size() * kWord);
  commands.run();

  const std::size_t items = begins.back(), runs = (items + kRadixRun - 1) / kRadixRun;
  digit_counts_.reserve(kRadixDigits * runs * kWord);
  scan.reserve(kRadixDigits * runs);
  commands.phase(&DeviceSeconds::sort);
  sorted_ = 0;
  const auto bits = static_cast<std::size_t>(std::bit_width(cells - 1));
  for (std::size_t shift = 0; shift < bits; shift += kRadixBits) {
    const RadixPush push{word(items), word(runs), word(shift)};
    commands.dispatch({"radix_count", {}}, {reads(items_[sorted_]), writes(digit_counts_)}, push, runs);
    scan.record(commands, digit_counts_, kRadixDigits * runs);
    commands.dispatch({"radix_scatter", {}},
                      {reads(items_[sorted_]), reads(digit_counts_), writes(items_[1 - sorted_])}, push, runs);
    sorted_ = 1 - sorted_;
  }
}

void CellPass::sum(SeedStage& stage, const PairStore& store, CellMoments& result) {
  Commands& commands = stage.commands;
  const DeviceSeeds& seeds = stage.seeds;
  const NeighbourPass& neighbours = stage.neighbours;
  const std::size_t cells = seeds.count(), real = double_ ? sizeof(double) : sizeof(float);
  const std::vector<std::uint32_t>& begins = begins_of_cells_;
  const std::size_t items = begins.back();
  std::size_t most = 0, blocks = 0;
  for (std::size_t c = 0; c < cells; ++c) {
    const std::size_t terms = begins[c + 1] - begins[c];
    most = std::max(most, terms);
    blocks += (terms + kSumBlock - 1) / kSumBlock;
  }
  for (Buffer& sums : sums_) sums.reserve(blocks * kMomentWords * real);
  for (Buffer& block_begins : block_begins_) block_begins.reserve((cells + 1) * kWord);
  sorted_places_.reserve(items * kWord);
  cells_.reserve(cells * kCellWords * real);

  commands.phase(&DeviceSeconds::sum);
  const CellsPush count{word(cells)};
  const Buffer* term_begins = &begins_;
  unsigned level = 0;
  for (std::size_t terms = most; level == 0 || terms > 1; ++level) {
    const Buffer &block_begins = block_begins_[level % 2], &sums = sums_[level % 2], &terms_in = sums_[(level + 1) % 2];
    commands.dispatch({"count_blocks", {}}, {reads(*term_begins), writes(block_begins)}, count, cells + 1);
    stage.scan.record(commands, block_begins, cells + 1);
    commands.dispatch(kernel("sum", double_, {level == 0}),
                      {reads(*term_begins), reads(block_begins), reads(items_[sorted_]), reads(store.mass_second),
                       reads(store.first), reads(terms_in), writes(sums), reads(store.pairs), reads(place_of_),
                       writes(sorted_places_), updates(stage.counters)},
                      count, blocks);
    term_begins = &block_begins;
    terms = (terms + kSumBlock - 1) / kSumBlock;
    blocks = std::min(blocks, blocks / kSumBlock + cells);
  }
  const Buffer& totals = sums_[(level + 1) % 2];
  commands.dispatch(kernel("cells", double_, {!stage.delaunay()}),
                    {reads(*term_begins), reads(totals), reads(neighbours.info()), reads(neighbours.lists()),
                     reads(neighbours.wide_lists()), writes(cells_)},
                    count, cells);

  std::vector<std::byte> words(cells * kCellWords * real);
  std::vector<std::uint32_t> sorted_places(items);
  Counters counted{};
  commands.phase(&DeviceSeconds::transfer);
  commands.download(cells_, 0, words.data(), words.size());
  if (items) commands.download(sorted_places_, 0, sorted_places.data(), items * kWord);
  commands.download(stage.counters, 0, counted.data(), sizeof counted);
  commands.run();
  if (counted[kDuplicatePairs])
    throw DeviceError(device_.description().name +
                      ": pairs were met twice, so its atomic operations are not to be trusted");

  read_cells(seeds, words, result);
  const std::size_t n = result.cells.size();
  result.triangles.offsets.assign(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    const Index slot = seeds.sorted.slot[i];
    result.triangles.offsets[i + 1] =
        result.triangles.offsets[i] + (slot == kNone ? 0 : begins[slot + 1] - begins[slot]);
  }
  result.triangles.values.resize(items);
  parallel_each(cells, [&](std::size_t slot) {
    std::copy(
        sorted_places.begin() + begins[slot], sorted_places.begin() + begins[slot + 1],
        result.triangles.values.begin() + static_cast<std::ptrdiff_t>(result.triangles.offsets[seeds.sorted.id[slot]]));
  });
}

void CellPass::read_cells(const DeviceSeeds& seeds, const std::vector<std::byte>& words, CellMoments& result) const {
  const std::size_t n = seeds.sorted.slot.size();
  result.cells.assign(n, Moments{});
  result.step_mass.assign(n, 0);
  const double scale = 1 / seeds.scale;
  parallel_each(seeds.count(), [&](std::size_t slot) {
    double reals[kCellWords];
    for (std::size_t k = 0; k < kCellWords; ++k) {
      if (double_) {
        std::memcpy(&reals[k], &words[(kCellWords * slot + k) * sizeof(double)], sizeof(double));
      } else {
        float narrow;
        std::memcpy(&narrow, &words[(kCellWords * slot + k) * sizeof(float)], sizeof(float));
        reals[k] = static_cast<double>(narrow);
      }
    }
    const Index i = seeds.sorted.id[slot];
    result.cells[i] = scaled({reals[0], {reals[1], reals[2], reals[3]}, reals[kSecondMomentAt]}, scale, solid_);
    result.step_mass[i] = reals[kCellMedianAt] < 0 ? -1 : scaled({reals[kCellMedianAt], {}, 0}, scale, solid_).mass;
  });
  result.mass = fixed_sum(n, [&](std::size_t i) { return result.cells[i].mass; });
  result.energy = fixed_sum(n, [&](std::size_t i) { return result.cells[i].second; });
}

}  // namespace bisector::host
