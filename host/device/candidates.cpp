#include "host/device/candidates.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>

#include "host/device/attempt.h"

namespace bisector::host {
namespace {

std::string kind_of(vk::PhysicalDeviceType type) {
  switch (type) {
    case vk::PhysicalDeviceType::eDiscreteGpu: return "discrete";
    case vk::PhysicalDeviceType::eIntegratedGpu: return "integrated";
    case vk::PhysicalDeviceType::eVirtualGpu: return "virtual";
    case vk::PhysicalDeviceType::eCpu: return "software";
    default: return "other";
  }
}

std::string version_text(std::uint32_t version) {
  return std::to_string(VK_API_VERSION_MAJOR(version)) + '.' + std::to_string(VK_API_VERSION_MINOR(version)) + '.' +
         std::to_string(VK_API_VERSION_PATCH(version));
}

std::string uuid_text(const std::uint8_t* bytes) {
  std::string text;
  for (int i = 0; i < 16; ++i) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02x", bytes[i]);
    if (i == 4 || i == 6 || i == 8 || i == 10) text += '-';
    text += digits;
  }
  return text;
}

std::uint64_t largest_local_heap(const vk::PhysicalDeviceMemoryProperties& memory) {
  std::uint64_t bytes = 0;
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
    const vk::MemoryHeap& heap = memory.memoryHeaps[i];
    if (heap.flags & vk::MemoryHeapFlagBits::eDeviceLocal) bytes = std::max<std::uint64_t>(bytes, heap.size);
  }
  return bytes;
}

// One with timestamps if there is one.
std::optional<std::uint32_t> compute_family(const std::vector<vk::QueueFamilyProperties>& families) {
  std::optional<std::uint32_t> found;
  for (std::uint32_t i = 0; i < families.size(); ++i) {
    if (!(families[i].queueFlags & vk::QueueFlagBits::eCompute)) continue;
    if (families[i].timestampValidBits) return i;
    if (!found) found = i;
  }
  return found;
}

std::string missing_limit(const vk::PhysicalDeviceLimits& limits) {
  const auto needs = [](const char* what, std::uint32_t has, std::uint32_t least) {
    return std::string(what) + " is " + std::to_string(has) + ", " + std::to_string(least) + " is needed";
  };
  if (limits.maxPerStageDescriptorStorageBuffers < kMaxBindings) {
    return needs("maxPerStageDescriptorStorageBuffers", limits.maxPerStageDescriptorStorageBuffers, kMaxBindings);
  }
  if (limits.maxPushConstantsSize < 128) return needs("maxPushConstantsSize", limits.maxPushConstantsSize, 128);
  if (limits.maxComputeWorkGroupInvocations < 64) {
    return needs("maxComputeWorkGroupInvocations", limits.maxComputeWorkGroupInvocations, 64);
  }
  if (limits.maxComputeWorkGroupSize[0] < 64) {
    return needs("maxComputeWorkGroupSize", limits.maxComputeWorkGroupSize[0], 64);
  }
  return {};
}

Candidate describe(vk::raii::PhysicalDevice physical, unsigned index) {
  Candidate candidate{.physical = std::move(physical), .description = {}, .limits = {}};
  DeviceDescription& text = candidate.description;
  const vk::PhysicalDeviceProperties basic = candidate.physical.getProperties();
  text.index = index;
  text.name = basic.deviceName.data();
  text.kind = kind_of(basic.deviceType);
  text.api = version_text(basic.apiVersion);
  text.memory = largest_local_heap(candidate.physical.getMemoryProperties());
  if (basic.apiVersion < VK_API_VERSION_1_2) {
    text.rejected = "it has Vulkan " + text.api + ", 1.2 is needed";
    return candidate;
  }

  const auto chain =
      candidate.physical.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceIDProperties,
                                        vk::PhysicalDeviceMaintenance3Properties, vk::PhysicalDeviceDriverProperties>();
  const auto& driver = chain.get<vk::PhysicalDeviceDriverProperties>();
  text.uuid = uuid_text(chain.get<vk::PhysicalDeviceIDProperties>().deviceUUID.data());
  text.driver = std::string(driver.driverName.data()) + ' ' + driver.driverInfo.data();
  candidate.unrolls = driver.driverID != vk::DriverId::eGoogleSwiftshader;
  candidate.allocation = chain.get<vk::PhysicalDeviceMaintenance3Properties>().maxMemoryAllocationSize;

  const vk::PhysicalDeviceLimits& limits = basic.limits;
  candidate.limits.storage_range = limits.maxStorageBufferRange;
  candidate.limits.storage_alignment = limits.minStorageBufferOffsetAlignment;
  candidate.limits.groups = std::min(limits.maxComputeWorkGroupCount[0], limits.maxComputeWorkGroupCount[1]);

  const auto families = candidate.physical.getQueueFamilyProperties();
  const std::optional<std::uint32_t> family = compute_family(families);
  if (!family) {
    text.rejected = "it has no compute queue";
    return candidate;
  }
  candidate.queue_family = *family;
  candidate.timestamp_bits = families[*family].timestampValidBits;
  candidate.timestamp_period = 1e-9 * static_cast<double>(limits.timestampPeriod);
  text.rejected = missing_limit(limits);
  text.float64 = candidate.physical.getFeatures().shaderFloat64;
  if (text.float64) text.features.push_back("float64");
  if (candidate.timestamp_bits) text.features.push_back("timestamps");
  return candidate;
}

}  // namespace

std::vector<Candidate> enumerate_candidates(const Instance& instance) {
  const vk::raii::PhysicalDevices devices =
      attempt("Vulkan", "vkEnumeratePhysicalDevices", [&] { return vk::raii::PhysicalDevices(instance.get()); });
  std::vector<Candidate> candidates;
  for (const vk::raii::PhysicalDevice& device : devices) {
    candidates.push_back(describe(device, static_cast<unsigned>(candidates.size())));
  }
  return candidates;
}

}  // namespace bisector::host
