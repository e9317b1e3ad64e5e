// Sums over cells: incident pairs sorted by cell and element, then summed by the one rule.
#pragma once

#include <utility>
#include <vector>

#include "host/passes/pair_pass.h"
#include "host/passes/seed_stage.h"

namespace bisector::host {

// Records the download of cells as CellPass leaves them, of `n` seeds, in the caller's lengths: moments, and step
// masses (negative where they are not known).
void download_cells(SeedStage& stage, const Buffer& cells, std::size_t n, bool is_solid, CellMoments& result);

class CellPass {
 public:
  // `is_solid`: masses are volumes.
  CellPass(Device& device, bool is_double, bool is_solid);

  // Once per domain: of each element its place in the order in which a cell's terms are summed, and how many places
  // there are.
  void set_elements(Commands& commands, const std::vector<Index>& places, std::size_t count);
  // Records the sorting of the pairs and the sums.
  void record(SeedStage& stage, const PairStore& store);
  // Records the sums once more, after the moments of some pairs have changed.
  void sum(SeedStage& stage, const PairStore& store);
  // Runs that. Fills in cells, mass and energy, of step_mass what the lists tell (negative where they do not), and the
  // places of each cell's elements as triangles if these are wanted. False if some cell has more pairs than was
  // expected; then all has to be recorded again.
  bool read(SeedStage& stage, bool with_triangles, CellMoments& result);
  // The same for those who read what they need themselves, once that has run.
  bool check(SeedStage& stage, const Counters& counters);

  // Of each cell, by the caller's index: mass, first and second moment, and the mass that scales steps.
  const Buffer& cells() const { return cells_; }
  // Where the places of each slot's elements begin.
  const Buffer& begins() const { return begins_; }
  // To keep the cells, or those places, in exchange for buffers that are used again.
  void exchange(Buffer& cells) { std::swap(cells_, cells); }
  void exchange_places(Buffer& places) { std::swap(sorted_places_, places); }
  // Pairs that are not empty, once they have been read.
  std::size_t items() const { return item_count_; }

 private:
  void sort_by_radix(SeedStage& stage, const PairStore& store);
  void sort_by_rank(SeedStage& stage, const PairStore& store);
  std::pair<const Buffer*, const Buffer*> sum_by_blocks(SeedStage& stage, const PairStore& store);
  void list_triangles(const DeviceSeeds& seeds, const std::vector<std::uint32_t>& begins,
                      const std::vector<std::uint32_t>& sorted_places, Csr<Index>& triangles) const;

  Device& device_;
  bool double_, solid_;
  std::size_t places_ = 0;
  Buffer place_of_, by_place_, begins_, cursors_, items_[2], digit_counts_, block_begins_[2], sums_[2], sorted_places_,
      cells_;
  bool by_rank_ = true;          // how the pairs were sorted
  std::size_t radix_up_to_ = 0;  // cells; of so few some had too many pairs for ranks
  unsigned sorted_ = 0;          // which of items_
  std::size_t most_items_ = 0;   // pairs that were sorted, empty ones among them
  std::size_t item_count_ = 0;
  std::vector<std::uint32_t> begins_of_cells_;  // of each cell's items, and the end of the last; by radix only
};

}  // namespace bisector::host
