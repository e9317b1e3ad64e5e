// Exclusive prefix sums on the device.
#pragma once

#include <vector>

#include "host/device/commands.h"

namespace bisector::host {

class Scan {
 public:
  explicit Scan(Device& device) : device_(device) {}

  // Reserves memory for arrays of up to `count` words; not while commands are recorded.
  void reserve(std::size_t count);
  // Records the replacement of the first `count` words by the sums of those before them.
  void record(Commands& commands, const Buffer& words, std::size_t count);

 private:
  void record(Commands& commands, const Buffer& words, std::size_t count, std::size_t level);

  Device& device_;
  std::vector<Buffer> totals_;  // of blocks, by level
};

}  // namespace bisector::host
