// A Vulkan buffer with memory of its own.
#pragma once

#include <cstddef>
#include <string>

#include "host/device/device.h"
#include "host/device/vulkan.h"

namespace bisector::host {

struct Allocation {
  vk::raii::DeviceMemory memory{nullptr};
  vk::raii::Buffer buffer{nullptr};
  std::byte* mapped = nullptr;  // null unless it was asked to be mapped
  std::size_t bytes = 0;
};

// Throws DeviceError.
Allocation allocate_local(const Device::Impl& device, std::size_t bytes);
// Mapped and coherent, and cached where there is such memory: reading what is not crawls.
Allocation allocate_staging(const Device::Impl& device, std::size_t bytes);

// "1.2 GiB"
std::string bytes_text(std::size_t bytes);

}  // namespace bisector::host
