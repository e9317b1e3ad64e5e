// Time on the device by phase and, where asked for, by kernel.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "host/device/commands.h"
#include "host/device/vulkan.h"

namespace bisector::host {

// Seconds on the device by kernel (or kind of transfer), over all of a device's recordings. Written as CSV, the longest
// first, when it is destroyed; a file that cannot be written is left out.
class KernelTimes {
 public:
  explicit KernelTimes(std::string path) : path_(std::move(path)) {}
  KernelTimes(const KernelTimes&) = delete;
  KernelTimes& operator=(const KernelTimes&) = delete;
  ~KernelTimes();

  void add(const std::string& name, double seconds);

 private:
  struct Sum {
    std::size_t runs = 0;
    double seconds = 0;
  };
  std::string path_;
  std::map<std::string, Sum> sums_;
};

// Does nothing on a queue without timestamps.
class Timestamps {
 public:
  explicit Timestamps(Device::Impl& device) : device_(device) {}

  // What follows in the recording counts for the phase, and for the kernel of that name; the first call of a recording
  // starts the clock. Throws DeviceError.
  void mark(const vk::raii::CommandBuffer& commands, Phase phase, std::string_view name);
  void finish(const vk::raii::CommandBuffer& commands);
  // Adds up what the device has run. Throws DeviceError.
  void collect();
  // Sums since the last call, in seconds.
  DeviceSeconds take();

 private:
  void write(const vk::raii::CommandBuffer& commands, vk::PipelineStageFlagBits stage);

  Device::Impl& device_;
  std::vector<vk::raii::QueryPool> pools_;
  std::vector<Phase> phases_;       // that begin at the marks of this recording
  std::vector<std::string> names_;  // of what begins there, if kernels are timed
  std::size_t written_ = 0;
  DeviceSeconds seconds_;
};

}  // namespace bisector::host
