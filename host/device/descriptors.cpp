#include "host/device/descriptors.h"

#include "host/device/device_impl.h"

namespace bisector::host {
namespace {

constexpr std::uint32_t kSets = 256;           // of a pool
constexpr std::uint32_t kBuffers = kSets * 8;  // of all sets of a pool

}  // namespace

vk::DescriptorSet Descriptors::bind(vk::DescriptorSetLayout layout,
                                    const std::vector<vk::DescriptorBufferInfo>& buffers) {
  choose_pool(buffers.size());
  const vk::DescriptorSetAllocateInfo info(*pools_[used_pools_ - 1], layout);
  const vk::Device device = *device_.device;
  // Not one RAII object a set: sets are given back with their pool.
  vk::DescriptorSet set;
  device_.attempt("vkAllocateDescriptorSets", [&] {
    const vk::Result result = device.allocateDescriptorSets(&info, &set, *device_.device.getDispatcher());
    vk::resultCheck(result, "vkAllocateDescriptorSets");
  });
  --sets_left_;
  buffers_left_ -= buffers.size();
  const vk::WriteDescriptorSet write(set, 0, 0, vk::DescriptorType::eStorageBuffer, {}, buffers, {});
  device_.device.updateDescriptorSets(write, {});
  return set;
}

void Descriptors::choose_pool(std::size_t buffers) {
  if (used_pools_ && sets_left_ && buffers <= buffers_left_) return;
  if (used_pools_ == pools_.size()) {
    const vk::DescriptorPoolSize size(vk::DescriptorType::eStorageBuffer, kBuffers);
    pools_.push_back(device_.attempt("vkCreateDescriptorPool", [&] {
      return vk::raii::DescriptorPool(device_.device, vk::DescriptorPoolCreateInfo({}, kSets, size));
    }));
  }
  ++used_pools_;
  sets_left_ = kSets;
  buffers_left_ = kBuffers;
}

void Descriptors::reset() {
  for (std::size_t i = 0; i < used_pools_; ++i) pools_[i].reset();
  used_pools_ = 0;
}

}  // namespace bisector::host
