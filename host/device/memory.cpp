#include "host/device/memory.h"

#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <optional>

#include "host/device/device_impl.h"

namespace bisector::host {
namespace {

using Usage = vk::BufferUsageFlagBits;
using Property = vk::MemoryPropertyFlagBits;

// The first type that has all of the first properties, else of the second, ...
std::optional<std::uint32_t> memory_type(const vk::PhysicalDeviceMemoryProperties& memory, std::uint32_t allowed,
                                         std::initializer_list<vk::MemoryPropertyFlags> wishes) {
  for (const vk::MemoryPropertyFlags wish : wishes) {
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
      if ((allowed >> i & 1) && (memory.memoryTypes[i].propertyFlags & wish) == wish) return i;
    }
  }
  return std::nullopt;
}

Allocation allocate(const Device::Impl& device, std::size_t bytes, vk::BufferUsageFlags usage,
                    std::initializer_list<vk::MemoryPropertyFlags> wishes) {
  const std::string size = bytes_text(bytes);
  Allocation allocation;
  allocation.buffer = device.attempt("vkCreateBuffer of " + size, [&] {
    return vk::raii::Buffer(device.device, vk::BufferCreateInfo({}, bytes, usage));
  });
  const vk::MemoryRequirements needs = allocation.buffer.getMemoryRequirements();
  const std::optional<std::uint32_t> type = memory_type(device.memory, needs.memoryTypeBits, wishes);
  if (!type) throw DeviceError(device.about.description.name + ": no memory type fits");
  if (needs.size > device.about.allocation) {
    throw DeviceError(device.about.description.name + ": " + size + " is more than one allocation may have (" +
                      bytes_text(device.about.allocation) + ")");
  }
  const vk::MemoryDedicatedAllocateInfo dedicated({}, *allocation.buffer);
  const vk::MemoryAllocateInfo info(needs.size, *type, &dedicated);
  allocation.memory =
      device.attempt("vkAllocateMemory of " + size, [&] { return vk::raii::DeviceMemory(device.device, info); });
  device.attempt("vkBindBufferMemory", [&] { allocation.buffer.bindMemory(*allocation.memory, 0); });
  allocation.bytes = bytes;
  return allocation;
}

}  // namespace

Allocation allocate_local(const Device::Impl& device, std::size_t bytes) {
  return allocate(device, bytes,
                  Usage::eStorageBuffer | Usage::eTransferSrc | Usage::eTransferDst | Usage::eIndirectBuffer,
                  {Property::eDeviceLocal, {}});
}

Allocation allocate_staging(const Device::Impl& device, std::size_t bytes) {
  const vk::MemoryPropertyFlags coherent = Property::eHostVisible | Property::eHostCoherent;
  Allocation allocation =
      allocate(device, bytes, Usage::eTransferSrc | Usage::eTransferDst, {coherent | Property::eHostCached, coherent});
  allocation.mapped = static_cast<std::byte*>(
      device.attempt("vkMapMemory", [&] { return allocation.memory.mapMemory(0, VK_WHOLE_SIZE); }));
  return allocation;
}

std::string bytes_text(std::size_t bytes) {
  constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  double value = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; value >= 1024 && unit + 1 < std::size(kUnits); ++unit) value /= 1024;
  char text[32];
  std::snprintf(text, sizeof text, unit ? "%.1f %s" : "%.0f %s", value, kUnits[unit]);
  return text;
}

}  // namespace bisector::host
