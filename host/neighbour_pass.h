// Lists of neighbours on the device, from either source.
#pragma once

#include "host/seed_grid.h"
#include "host/seeds.h"

namespace bisector::host {

class NeighbourPass {
 public:
  NeighbourPass(Device& device, bool is_double);

  // Plans grids for seeds that lie about `spacing` apart and makes room; not while commands are recorded. Records the first
  // grid.
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
  SeedGrid grid_, wide_grid_;
  Buffer info_, lists_, wide_lists_, targets_, is_target_;
  std::uint32_t most_ = 0;         // entries of a first list
  std::size_t target_room_ = 0;
  bool wide_grid_built_ = false;
};

}  // namespace bisector::host
