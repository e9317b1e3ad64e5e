// Host-visible memory that uploads and downloads pass through.
#pragma once

#include <cstddef>
#include <vector>

#include "host/device/memory.h"

namespace bisector::host {

class Staging {
 public:
  explicit Staging(Device::Impl& device) : device_(device) {}

  struct Span {
    vk::Buffer buffer;
    std::size_t offset = 0;
    std::size_t bytes = 0;
    std::byte* mapped = nullptr;
  };

  // Up to `bytes`, a multiple of `unit` as `bytes` is, and at least one unit unless all that one may have is in use:
  // then 0. A unit is at most kLargestUnit. Throws DeviceError.
  static constexpr std::size_t kLargestUnit = std::size_t{1} << 16;
  Span take(std::size_t bytes, std::size_t unit = 1);
  // Nothing is in use any more; the memory is kept.
  void reset();

 private:
  Device::Impl& device_;
  std::vector<Allocation> chunks_;
  std::size_t current_ = 0;  // chunks before this one are full
  std::size_t used_ = 0;     // of the current chunk
  std::size_t total_ = 0;    // of all chunks
};

}  // namespace bisector::host
