// Sums over cells: incident pairs sorted by cell and element, then summed by the one rule.
#pragma once

#include <vector>

#include "host/passes/pair_pass.h"
#include "host/passes/seed_stage.h"

namespace bisector::host {

class CellPass {
 public:
  // `is_solid`: masses are volumes.
  CellPass(Device& device, bool is_double, bool is_solid);

  // Once per domain: of each element its place in the order in which a cell's terms are summed, and how many places
  // there are.
  void set_elements(Commands& commands, const std::vector<Index>& places, std::size_t count);
  // Brings the pairs into the order in which they are summed.
  void sort(Commands& commands, std::size_t cells, Scan& scan, const PairStore& store);
  // Fills in cells, mass and energy, of step_mass what the lists tell (negative where they do not), and as triangles
  // the places of each cell's elements.
  void sum(SeedStage& stage, const PairStore& store, CellMoments& result);
  // Mass, first and second moment of each cell, and the median mass nearby.
  const Buffer& cells() const { return cells_; }

 private:
  void read_cells(const DeviceSeeds& seeds, const std::vector<std::byte>& words, CellMoments& result) const;

  Device& device_;
  bool double_, solid_;
  std::size_t places_ = 0;
  Buffer place_of_, by_place_, begins_, items_[2], digit_counts_, block_begins_[2], sums_[2], sorted_places_, cells_;
  unsigned sorted_ = 0;                         // which of items_
  std::vector<std::uint32_t> begins_of_cells_;  // of each cell's items, and the end of the last
};

}  // namespace bisector::host
