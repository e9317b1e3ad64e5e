// Time on the device by phase.
#pragma once

#include <cstddef>
#include <vector>

#include "host/device/commands.h"
#include "host/device/vulkan.h"

namespace bisector::host {

// Does nothing on a queue without timestamps.
class Timestamps {
 public:
  explicit Timestamps(Device::Impl& device) : device_(device) {}

  // What follows in the recording counts for the phase; the first call of a recording starts the clock. Throws
  // DeviceError.
  void mark(const vk::raii::CommandBuffer& commands, Phase phase);
  void finish(const vk::raii::CommandBuffer& commands);
  // Adds up what the device has run. Throws DeviceError.
  void collect();
  // Sums since the last call, in seconds.
  DeviceSeconds take();

 private:
  void write(const vk::raii::CommandBuffer& commands, vk::PipelineStageFlagBits stage);

  Device::Impl& device_;
  std::vector<vk::raii::QueryPool> pools_;
  std::vector<Phase> phases_;  // that begin at the marks of this recording
  std::size_t written_ = 0;
  DeviceSeconds seconds_;
};

}  // namespace bisector::host
