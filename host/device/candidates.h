// The physical devices of an instance, and which of them can be used.
#pragma once

#include <cstdint>
#include <vector>

#include "bisector/device.h"
#include "host/device/device.h"
#include "host/device/instance.h"

namespace bisector::host {

// Storage buffers that one kernel may bind.
inline constexpr std::uint32_t kMaxBindings = 16;

struct Candidate {
  vk::raii::PhysicalDevice physical;
  DeviceDescription description;  // float64 only says that the driver promises it
  DeviceLimits limits;
  std::uint64_t allocation = 0;  // bytes that one allocation may have
  std::uint32_t queue_family = 0;
  std::uint32_t timestamp_bits = 0;  // 0 without timestamps
  double timestamp_period = 0;       // seconds
  bool unrolls = true;               // false where the driver takes minutes to compile loops that are unrolled
};

// In the loader's order. Throws DeviceError.
std::vector<Candidate> enumerate_candidates(const Instance& instance);

}  // namespace bisector::host
