#include "host/passes/cell_pass.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <tuple>

#include "core/parallel.h"
#include "host/passes/packing.h"
#include "kernels/layout/push.h"
#include "kernels/layout/sizes.h"
#include "voronoi/totals.h"

namespace bisector::host {
namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);
// Pairs of a cell on average from which they are sorted by radix instead of ranks.
constexpr std::size_t kMostByRank = 64;

uint word(std::size_t n) { return static_cast<uint>(n); }

}  // namespace

CellPass::CellPass(Device& device, bool is_double, bool is_solid)
    : device_(device), double_(is_double), solid_(is_solid), place_of_(device), by_place_(device), begins_(device),
      cursors_(device), items_{Buffer(device), Buffer(device)},
      digit_counts_(device), block_begins_{Buffer(device), Buffer(device)}, sums_{Buffer(device), Buffer(device)},
      sorted_places_(device), cells_(device) {}

void CellPass::set_elements(Commands& commands, const std::vector<Index>& places, std::size_t count) {
  places_ = count;
  upload(commands, place_of_, places);
}

void CellPass::record(SeedStage& stage, const PairStore& store) {
  const std::size_t cells = stage.seeds.count();
  by_rank_ = cells > radix_up_to_ && store.count <= kMostByRank * cells;
  most_items_ = store.count;
  begins_.reserve((cells + 1) * kWord);
  for (Buffer& items : items_) items.reserve(store.count * sizeof(SortItem));
  sorted_places_.reserve(store.count * kWord);
  cells_.reserve(stage.seeds.given_count() * kCellWords * (double_ ? sizeof(double) : sizeof(float)));
  if (by_rank_) sort_by_rank(stage, store);
  else sort_by_radix(stage, store);
  sum(stage, store);
}

void CellPass::sort_by_rank(SeedStage& stage, const PairStore& store) {
  Commands& commands = stage.commands;
  const std::size_t cells = stage.seeds.count(), bytes = (cells + 1) * kWord;
  cursors_.reserve(bytes);
  by_place_.reserve(kWord);
  sums_[0].reserve(cells * kMomentWords * (double_ ? sizeof(double) : sizeof(float)));
  stage.scan.reserve(cells + 1);
  commands.phase(&DeviceSeconds::sort);
  commands.fill(begins_, 0, bytes, 0);
  commands.fill(stage.counters, kLargeCells * kWord, kWord, 0);
  const CountPush pairs{word(store.count)};
  commands.dispatch({"count_pairs", {false}},
                    {reads(store.pairs), reads(store.status), reads(place_of_), updates(by_place_), updates(begins_)},
                    pairs, store.count);
  stage.scan.record(commands, begins_, cells + 1);
  commands.copy(begins_, 0, cursors_, 0, bytes);
  commands.dispatch({"scatter_pairs", {false}},
                    {reads(store.pairs), reads(store.status), reads(place_of_), updates(cursors_), writes(items_[0])},
                    pairs, store.count);
  commands.dispatch({"rank_items", {}},
                    {reads(store.pairs), reads(items_[0]), reads(begins_), writes(items_[1]), writes(sorted_places_),
                     updates(stage.counters)},
                    CellsPush{word(cells)}, std::max<std::size_t>(store.count, 1));
  sorted_ = 1;
}

// Runs what is recorded, to know how many items there are.
void CellPass::sort_by_radix(SeedStage& stage, const PairStore& store) {
  Commands& commands = stage.commands;
  Scan& scan = stage.scan;
  const std::size_t cells = stage.seeds.count();
  by_place_.reserve((places_ + 1) * kWord);
  scan.reserve(std::max(places_, cells) + 1);
  commands.phase(&DeviceSeconds::sort);
  commands.fill(by_place_, 0, (places_ + 1) * kWord, 0);
  commands.fill(begins_, 0, (cells + 1) * kWord, 0);
  const CountPush pairs{word(store.count)};
  commands.dispatch({"count_pairs", {true}},
                    {reads(store.pairs), reads(store.status), reads(place_of_), updates(by_place_), updates(begins_)},
                    pairs, store.count);
  scan.record(commands, by_place_, places_ + 1);
  scan.record(commands, begins_, cells + 1);
  commands.dispatch({"scatter_pairs", {true}},
                    {reads(store.pairs), reads(store.status), reads(place_of_), updates(by_place_), writes(items_[0])},
                    pairs, store.count);
  std::vector<std::uint32_t>& begins = begins_of_cells_;
  begins.resize(cells + 1);
  commands.download(begins_, 0, begins.data(), begins.size() * kWord);
  commands.run();

  const std::size_t items = begins.back(), runs = (items + kRadixRun - 1) / kRadixRun;
  item_count_ = items;
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

void CellPass::sum(SeedStage& stage, const PairStore& store) {
  Commands& commands = stage.commands;
  const DeviceSeeds& seeds = stage.seeds;
  const NeighbourPass& neighbours = stage.neighbours;
  const CellsPush count{word(seeds.count())};
  commands.phase(&DeviceSeconds::sum);
  const Buffer* term_begins = &begins_;
  const Buffer* totals = &sums_[0];
  if (by_rank_) {
    commands.dispatch(
        kernel("sum_cells", double_),
        {reads(begins_), reads(items_[sorted_]), reads(store.mass_second), reads(store.first), writes(sums_[0])}, count,
        seeds.count());
  } else {
    std::tie(term_begins, totals) = sum_by_blocks(stage, store);
  }
  // Of seeds without a slot nothing else is known than that they own nothing.
  if (seeds.count() < seeds.given_count()) commands.fill(cells_, 0, cells_.size() / kWord * kWord, 0);
  commands.dispatch(kernel("cells", double_, {!stage.delaunay(), by_rank_}),
                    {reads(*term_begins), reads(*totals), reads(neighbours.info()), reads(neighbours.lists()),
                     reads(neighbours.wide_lists()), updates(cells_), reads(seeds.ids)},
                    count, seeds.count());
}

// Level by level, one invocation a block. Returns where each cell's one sum begins, and the sums.
std::pair<const Buffer*, const Buffer*> CellPass::sum_by_blocks(SeedStage& stage, const PairStore& store) {
  Commands& commands = stage.commands;
  const std::size_t cells = stage.seeds.count(), real = double_ ? sizeof(double) : sizeof(float);
  const std::vector<std::uint32_t>& begins = begins_of_cells_;
  std::size_t most = 0, blocks = 0;
  for (std::size_t c = 0; c < cells; ++c) {
    const std::size_t terms = begins[c + 1] - begins[c];
    most = std::max(most, terms);
    blocks += (terms + kSumBlock - 1) / kSumBlock;
  }
  for (Buffer& sums : sums_) sums.reserve(blocks * kMomentWords * real);
  for (Buffer& block_begins : block_begins_) block_begins.reserve((cells + 1) * kWord);
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
  return {term_begins, &sums_[(level + 1) % 2]};
}

void download_cells(SeedStage& stage, const Buffer& cells, std::size_t n, bool is_solid, CellMoments& result) {
  const bool is_double = stage.is_double();
  const std::size_t real = is_double ? sizeof(double) : sizeof(float);
  const double scale = 1 / stage.seeds.scale;
  result.cells.resize(n);
  result.step_mass.resize(n);
  stage.commands.phase(&DeviceSeconds::transfer);
  stage.commands.download_items(
      cells, kCellWords * real, n,
      [&result, is_double, is_solid, real, scale](const std::byte* at, std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i, at += kCellWords * real) {
          std::array<double, kCellWords> reals;
          if (is_double) {
            std::memcpy(reals.data(), at, sizeof reals);
          } else {
            std::array<float, kCellWords> narrow;
            std::memcpy(narrow.data(), at, sizeof narrow);
            std::copy(narrow.begin(), narrow.end(), reals.begin());
          }
          result.cells[i] = scaled({reals[0], {reals[1], reals[2], reals[3]}, reals[kSecondMomentAt]}, scale, is_solid);
          const double step_mass = reals[kCellStepMassAt];
          result.step_mass[i] = step_mass < 0 ? -1 : scaled({step_mass, {}, 0}, scale, is_solid).mass;
        }
      });
}

bool CellPass::read(SeedStage& stage, bool with_triangles, CellMoments& result) {
  Commands& commands = stage.commands;
  const DeviceSeeds& seeds = stage.seeds;
  const std::size_t cells = seeds.count();
  download_cells(stage, cells_, seeds.given_count(), solid_, result);
  std::vector<std::uint32_t> sorted_places(with_triangles ? most_items_ : 0), begins(with_triangles ? cells + 1 : 0);
  if (with_triangles) {
    commands.download(begins_, 0, begins.data(), begins.size() * kWord);
    commands.download(sorted_places_, 0, sorted_places.data(), sorted_places.size() * kWord);
  }
  if (!check(stage, stage.run_counted())) return false;
  set_totals(result);
  if (with_triangles) list_triangles(seeds, begins, sorted_places, result.triangles);
  else result.triangles = {};
  return true;
}

bool CellPass::check(SeedStage& stage, const Counters& counted) {
  if (counted[kDuplicatePairs])
    throw DeviceError(device_.description().name +
                      ": pairs were met twice, so its atomic operations are not to be trusted");
  if (!by_rank_) return true;
  if (counted[kLargeCells]) {
    radix_up_to_ = stage.seeds.count();
    return false;
  }
  item_count_ = counted[kItems];
  return true;
}

void CellPass::list_triangles(const DeviceSeeds& seeds, const std::vector<std::uint32_t>& begins,
                              const std::vector<std::uint32_t>& sorted_places, Csr<Index>& triangles) const {
  const std::size_t n = seeds.given_count();
  triangles.offsets.assign(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    const Index slot = seeds.slot(i);
    triangles.offsets[i + 1] = triangles.offsets[i] + (slot == kNone ? 0 : begins[slot + 1] - begins[slot]);
  }
  triangles.values.resize(begins.back());
  parallel_each(seeds.count(), [&](std::size_t slot) {
    std::copy(sorted_places.begin() + begins[slot], sorted_places.begin() + begins[slot + 1],
              triangles.values.begin() + static_cast<std::ptrdiff_t>(triangles.offsets[seeds.id(slot)]));
  });
}

}  // namespace bisector::host
