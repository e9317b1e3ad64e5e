// Lists of neighbours on the device, from either source.
#pragma once

#include <algorithm>
#include <cstdint>

#include "host/passes/seed_tree.h"
#include "host/passes/seeds.h"
#include "kernels/layout/counters.h"

namespace bisector::host {

// How long lists are, and how many boxes of the tree are looked at for a first one.
struct ListSizes {
  std::uint32_t most, opened;
  std::uint32_t wide;  // entries of the next list, a power of two
};
// A random planar cell has six neighbours and is certified by about 16 nearest seeds, a random spatial one has 15.5 and
// takes about 80, or 20 once it is optimised.
inline constexpr ListSizes kSurfaceLists{32, 2048, 128}, kSolidLists{96, 4096, 256};

class NeighbourPass {
 public:
  // `wide`: entries of wider lists that there is room for at first; 0: by what is expected.
  NeighbourPass(Device& device, bool is_double, const ListSizes& sizes, std::size_t wide);

  // Reserves memory for lists and the tree; not while commands are recorded. Records the tree.
  void begin(Commands& commands, const DeviceSeeds& seeds);
  // Records the search for the first lists.
  void list_nearest(Commands& commands, const DeviceSeeds& seeds, const Buffer& counters);
  // Records the upload of lists that the host has.
  void upload_lists(Commands& commands, const DeviceSeeds& seeds, const Neighbours& neighbours);
  // Records the choice of cells that need a wider list, those of the pairs at work with too short a
  // list, which lie in `flagged` from `first_flagged` on, that have none yet.
  void choose_targets(Commands& commands, const Buffer& flagged, std::size_t first_flagged, const Buffer& pairs,
                      const Buffer& counters);
  // Records the search for the wider lists of the cells that are at work.
  void widen(Commands& commands, const DeviceSeeds& seeds, const Buffer& counters);
  // How many entries the evaluation has wanted for wider lists: there is room for more from the next begin() on.
  void wanted(std::size_t entries) { most_wanted_ = std::max(most_wanted_, entries); }

  // Cells that can be listed for wider lists in an evaluation: each for both.
  std::size_t target_capacity() const { return targets_.size() / sizeof(uint); }
  const SeedTree& tree() const { return tree_; }
  const Buffer& info() const { return info_; }
  const Buffer& lists() const { return lists_; }
  const Buffer& wide_lists() const { return wide_lists_; }

 private:
  Device& device_;
  bool double_;
  ListSizes sizes_;
  SeedTree tree_;
  Buffer info_, lists_, wide_lists_, targets_, width_;
  std::uint32_t most_ = 0;                                        // entries of a first list
  std::size_t asked_wide_, wide_capacity_ = 0, most_wanted_ = 0;  // entries of wider lists
  bool may_grow_ = true;
};

}  // namespace bisector::host
