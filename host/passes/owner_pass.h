// The cells that own points: mesh vertices and samples.
#pragma once

#include <vector>

#include "host/passes/neighbour_pass.h"
#include "host/passes/seeds.h"

namespace bisector::host {

class OwnerPass {
 public:
  OwnerPass(Device& device, bool is_double);

  // Records the upload of new points. Their owners are looked for from scratch at first.
  void set_points(Commands& commands, const std::vector<Vec3>& points, double scale);
  // Forgets the last owners, whose slots no longer mean the same seeds.
  void forget() { fresh_ = true; }
  // Records the search. With `report`, points without a certain owner are listed; else they are left with none.
  void record(Commands& commands, const DeviceSeeds& seeds, const SeedGrid& grid, const Buffer& counters, bool report);
  // Downloads the points listed, `count` of them.
  std::vector<Index> lost(Commands& commands, std::size_t count);
  // Records the owners that were found elsewhere.
  void settle(Commands& commands, const std::vector<Index>& points, const std::vector<Index>& slots);

  const Buffer& owners() const { return owners_; }

 private:
  bool double_;
  Buffer points_, owners_, lost_, pokes_;
  std::size_t count_ = 0;
  bool fresh_ = true;
};

}  // namespace bisector::host
