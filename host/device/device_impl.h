// What a Device consists of.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "host/device/attempt.h"
#include "host/device/buffer.h"
#include "host/device/candidates.h"
#include "host/device/device.h"
#include "host/device/instance.h"
#include "host/device/pipelines.h"
#include "host/device/timestamps.h"

namespace bisector::host {

struct Device::Impl {
  // Throws DeviceError.
  Impl(std::shared_ptr<const Instance> instance, const Candidate& candidate);

  // A device that has gone through the self-tests: description().rejected says if it failed. Throws DeviceError.
  static std::unique_ptr<Device> make(std::shared_ptr<const Instance> instance, const Candidate& candidate);

  // One fallible call.
  template <class Function>
  decltype(auto) attempt(std::string_view call, Function&& function) const {
    return host::attempt(about.description.name, call, std::forward<Function>(function));
  }

  std::shared_ptr<const Instance> instance;
  Candidate about;
  vk::PhysicalDeviceMemoryProperties memory;
  vk::raii::Device device;
  vk::raii::Queue queue;
  std::optional<Pipelines> pipelines;
  std::optional<KernelTimes> kernel_times;
  std::vector<Buffer::Impl*> buffers;   // all that there are
  std::optional<std::uint32_t> poison;  // what new memory is filled with, for tests (host/device/faults.h)
};

}  // namespace bisector::host
