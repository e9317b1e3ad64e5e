// Lists of neighbours on the device, from either source.
#pragma once

#include <cstdint>

#include "host/passes/seed_grid.h"
#include "host/passes/seeds.h"

namespace bisector::host {

// How long lists are, and the edges of the grids' cells that they are found with, in typical spacings.
struct ListSizes {
  std::uint32_t most, examined;  // entries of a first list, and seeds that are looked at for it
  double cell;
  std::uint32_t wide_most, wide_examined;
  double wide_cell;
  double wide_share;  // of the seeds, whose wide lists there is memory for
};
// A random planar cell has six neighbours and is certified by about 16 nearest seeds, a random spatial one has 15.5 and
// takes about 80, or 20 once it is optimised.
inline constexpr ListSizes kSurfaceLists{32, 512, 1.8, 224, 1024, 4.5, 0.25},
    kSolidLists{96, 1024, 2.9, 256, 1536, 3.3, 1};

class NeighbourPass {
 public:
  NeighbourPass(Device& device, bool is_double, const ListSizes& sizes);

  // Plans grids for seeds that lie about `spacing` apart and reserves memory; not while commands are recorded. Records
  // the first grid.
  void begin(Commands& commands, const DeviceSeeds& seeds, double spacing, Scan& scan);
  // Records the search for the first lists.
  void list_nearest(Commands& commands, const DeviceSeeds& seeds, const Buffer& counters);
  // Records the upload of lists that the host has.
  void upload_lists(Commands& commands, const DeviceSeeds& seeds, const Neighbours& neighbours);
  // Records wider lists for the cells of flagged pairs that have none yet. `targets`: how many have.
  void widen(Commands& commands, const DeviceSeeds& seeds, Scan& scan, const Buffer& flagged, std::size_t flagged_count,
             const Buffer& pairs, std::size_t targets, const Buffer& counters);

  const SeedGrid& grid() const { return grid_; }
  const Buffer& info() const { return info_; }
  const Buffer& lists() const { return lists_; }
  const Buffer& wide_lists() const { return wide_lists_; }

 private:
  void search(Commands& commands, const DeviceSeeds& seeds, const SeedGrid& grid, const Buffer& counters, bool targets,
              std::size_t first_target, std::size_t items);

  Device& device_;
  bool double_;
  ListSizes sizes_;
  SeedGrid grid_, wide_grid_;
  Buffer info_, lists_, wide_lists_, targets_, is_target_;
  std::uint32_t most_ = 0;  // entries of a first list
  std::size_t target_capacity_ = 0;
  bool wide_grid_built_ = false;
};

}  // namespace bisector::host
