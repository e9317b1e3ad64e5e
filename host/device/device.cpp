#include "host/device/device.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "host/device/device_impl.h"
#include "host/device/faults.h"
#include "host/device/selftest.h"

namespace bisector::host {
namespace {

constexpr const char* kPortabilitySubset = "VK_KHR_portability_subset";

vk::raii::Device make_device(const Candidate& candidate) {
  const std::string& name = candidate.description.name;
  const float priority = 1;
  const vk::DeviceQueueCreateInfo queue({}, candidate.queue_family, 1, &priority);
  vk::PhysicalDeviceFeatures features;
  features.shaderFloat64 = candidate.description.float64;

  const auto extensions = attempt(name, "vkEnumerateDeviceExtensionProperties",
                                  [&] { return candidate.physical.enumerateDeviceExtensionProperties(); });
  const bool portability = std::ranges::any_of(
      extensions, [](const auto& extension) { return std::strcmp(extension.extensionName, kPortabilitySubset) == 0; });
  vk::DeviceCreateInfo info({}, queue, {}, {}, &features);
  if (portability) info.setPEnabledExtensionNames(kPortabilitySubset);
  return attempt(name, "vkCreateDevice", [&] { return vk::raii::Device(candidate.physical, info); });
}

}  // namespace

Device::Impl::Impl(std::shared_ptr<const Instance> shared_instance, const Candidate& candidate)
    : instance(std::move(shared_instance)), about(candidate), memory(about.physical.getMemoryProperties()),
      device(make_device(about)), queue(device, about.queue_family, 0), pipelines(std::in_place, *this) {
  if (const char* path = std::getenv("BISECTOR_KERNEL_TIMES")) kernel_times.emplace(path);
}

std::unique_ptr<Device> Device::Impl::make(std::shared_ptr<const Instance> instance, const Candidate& candidate) {
  std::unique_ptr<Device> device(new Device(std::make_unique<Impl>(std::move(instance), candidate)));
  DeviceDescription& description = device->impl().about.description;
  description.rejected = selftest_single(*device);
  if (description.float64 && !selftest_double(*device)) {
    description.float64 = false;
    std::erase(description.features, "float64");
  }
  return device;
}

Device::Device(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Device::~Device() = default;

const DeviceDescription& Device::description() const { return impl_->about.description; }
const DeviceLimits& Device::limits() const { return impl_->about.limits; }

void hide_float64(Device& device) {
  DeviceDescription& description = device.impl().about.description;
  description.float64 = false;
  std::erase(description.features, "float64");
}

void limit_storage_range(Device& device, std::size_t bytes) {
  std::size_t& range = device.impl().about.limits.storage_range;
  range = std::min(range, bytes);
}

void permute_invocations(Device& device, std::uint32_t odd) { device.impl().pipelines->set_order(odd); }

}  // namespace bisector::host
