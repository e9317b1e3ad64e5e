// The tree of boxes over the seeds, on the device (kernels/seed_tree.glsl).
#pragma once

#include <algorithm>
#include <array>

#include "host/passes/packing.h"
#include "host/passes/seeds.h"
#include "kernels/layout/sizes.h"

namespace bisector::host {

class SeedTree {
 public:
  explicit SeedTree(Device& device) : boxes_(device) {}

  // Reserves memory; not while commands are recorded.
  void plan(std::size_t seeds);
  // Records the making of the boxes.
  void record(Commands& commands, const DeviceSeeds& seeds, bool is_double);

  // What kernels that search have first among their push constants.
  template <class Push>
  Push push(const DeviceSeeds& seeds) const {
    Push push{};
    push.seed_count = static_cast<uint>(seeds.count());
    push.top_level = top_level_;
    push.residual = seeds.residual;
    push.two = kTwo;
    std::copy(level_begin_.begin(), level_begin_.end(), push.level_begin);
    return push;
  }
  const Buffer& boxes() const { return boxes_; }

 private:
  std::array<uint, kTreeLevels> level_begin_{};  // and behind the last level that there is its end
  uint top_level_ = 0;
  Buffer boxes_;
};

}  // namespace bisector::host
