// Sums over cells: incident pairs sorted by cell and triangle, then summed by the one rule.
#pragma once

#include <vector>

#include "host/counters.h"
#include "host/pair_pass.h"

namespace bisector::host {

class CellPass {
 public:
  CellPass(Device& device, bool is_double);

  // The facets' triangles, once per surface.
  void set_surface(Commands& commands, const Surface& surface);
  // Brings the pairs into the order in which they are summed.
  void sort(Commands& commands, std::size_t cells, Scan& scan, const PairStore& store);
  // Fills in cells, triangles, mass and energy, and of step_mass what the lists tell: negative where they do not. `medians`:
  // whether the lists are of the nearest seeds.
  void sum(Commands& commands, const DeviceSeeds& seeds, const NeighbourPass& neighbours, bool medians, Scan& scan,
           const Buffer& counters, const PairStore& store, CellMoments& result);
  // Mass, first and second moment of each cell, and the median mass nearby.
  const Buffer& cells() const { return cells_; }

 private:
  void read_cells(const DeviceSeeds& seeds, const std::vector<std::byte>& words, CellMoments& result) const;

  Device& device_;
  bool double_;
  std::size_t triangles_ = 0;
  Buffer triangle_of_, by_triangle_, begins_, items_[2], digit_counts_, block_begins_[2], sums_[2], sorted_triangles_, cells_;
  unsigned sorted_ = 0;               // which of items_
  std::vector<std::uint32_t> begins_of_cells_;  // of each cell's items, and the end of the last
};

}  // namespace bisector::host
