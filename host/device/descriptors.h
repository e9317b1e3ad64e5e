// Descriptor sets for one recording.
#pragma once

#include <cstdint>
#include <vector>

#include "host/device/device.h"
#include "host/device/vulkan.h"

namespace bisector::host {

class Descriptors {
 public:
  explicit Descriptors(Device::Impl& device) : device_(device) {}

  // A set of that layout bound to whole storage buffers, in order. Throws DeviceError.
  vk::DescriptorSet bind(vk::DescriptorSetLayout layout, const std::vector<vk::DescriptorBufferInfo>& buffers);
  // Gives all sets back.
  void reset();

 private:
  // Goes on to the next pool unless the current one can hold one more set.
  void choose_pool(std::size_t buffers);

  Device::Impl& device_;
  std::vector<vk::raii::DescriptorPool> pools_;
  std::size_t used_pools_ = 0;  // the last of them is current
  std::uint32_t sets_left_ = 0;
  std::size_t buffers_left_ = 0;
};

}  // namespace bisector::host
