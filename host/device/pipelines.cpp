#include "host/device/pipelines.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "host/device/device_impl.h"
#include "host/device/modules.h"
#include "kernels/layout/sizes.h"

namespace bisector::host {
namespace {

CacheOwner owner_of(const Candidate& candidate) {
  const vk::PhysicalDeviceProperties properties = candidate.physical.getProperties();
  CacheOwner owner{properties.vendorID, properties.deviceID, properties.driverVersion, {}};
  std::ranges::copy(properties.pipelineCacheUUID, owner.uuid.begin());
  return owner;
}

}  // namespace

bool Pipelines::Less::operator()(const Kernel& a, const Kernel& b) const {
  return std::tie(a.name, a.constants) < std::tie(b.name, b.constants);
}

Pipelines::Pipelines(const Device::Impl& device)
    : device_(device), owner_(owner_of(device.about)), file_(cache_path(device.about.description.uuid)),
      cache_(nullptr) {
  const std::vector<std::uint8_t> start = load_cache(file_, owner_);
  cache_ = device_.attempt("vkCreatePipelineCache", [&] {
    return vk::raii::PipelineCache(device_.device, vk::PipelineCacheCreateInfo({}, start.size(), start.data()));
  });
}

Pipelines::~Pipelines() {
  if (file_.empty()) return;
  try {
    store_cache(file_, owner_, cache_.getData());
  } catch (const std::exception&) {
    // The cache only saves time.
  }
}

const Pipeline& Pipelines::get(const Kernel& kernel, std::size_t bindings, std::size_t push_bytes) {
  auto found = pipelines_.find(kernel);
  if (found == pipelines_.end()) found = pipelines_.emplace(kernel, make(kernel, bindings, push_bytes)).first;
  if (found->second.bindings != bindings || found->second.push_bytes != push_bytes) {
    throw std::logic_error("kernel " + kernel.name + " was used before with other numbers of bindings or constants");
  }
  return found->second;
}

std::vector<KernelUse> Pipelines::used() const {
  std::vector<KernelUse> all;
  for (const auto& [kernel, pipeline] : pipelines_) all.push_back({kernel, pipeline.bindings, pipeline.push_bytes});
  return all;
}

Pipeline Pipelines::make(const Kernel& kernel, std::size_t bindings, std::size_t push_bytes) const {
  if (bindings > kMaxBindings) throw std::logic_error("kernel " + kernel.name + " has too many bindings");
  const vk::raii::Device& device = device_.device;

  std::vector<vk::DescriptorSetLayoutBinding> slots;
  for (std::uint32_t i = 0; i < bindings; ++i) {
    slots.emplace_back(i, vk::DescriptorType::eStorageBuffer, 1, vk::ShaderStageFlagBits::eCompute);
  }
  vk::raii::DescriptorSetLayout set_layout = device_.attempt("vkCreateDescriptorSetLayout", [&] {
    return vk::raii::DescriptorSetLayout(device, vk::DescriptorSetLayoutCreateInfo({}, slots));
  });

  const vk::PushConstantRange push(vk::ShaderStageFlagBits::eCompute, 0, static_cast<std::uint32_t>(push_bytes));
  vk::raii::PipelineLayout layout = device_.attempt("vkCreatePipelineLayout", [&] {
    return vk::raii::PipelineLayout(device, vk::PipelineLayoutCreateInfo({}, *set_layout, push));
  });

  std::span<const std::uint32_t> words = module_words(kernel.name);
  std::vector<std::uint32_t> plain;
  if (!device_.about.unrolls) words = plain = without_loop_control(words);
  const vk::raii::ShaderModule shader = device_.attempt("vkCreateShaderModule", [&] {
    return vk::raii::ShaderModule(device, vk::ShaderModuleCreateInfo({}, words.size_bytes(), words.data()));
  });

  std::vector<std::uint32_t> values = kernel.constants;
  std::vector<vk::SpecializationMapEntry> entries;
  for (std::uint32_t i = 0; i < values.size(); ++i) entries.emplace_back(i, i * 4, 4);
  if (order_ != 1) {
    entries.emplace_back(kOrderConstant, static_cast<std::uint32_t>(values.size() * 4), 4);
    values.push_back(order_);
  }
  const vk::SpecializationInfo constants(static_cast<std::uint32_t>(entries.size()), entries.data(), values.size() * 4,
                                         values.data());
  const vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *shader, "main", &constants);
  vk::raii::Pipeline pipeline = device_.attempt("vkCreateComputePipelines of " + kernel.name, [&] {
    return vk::raii::Pipeline(device, cache_, vk::ComputePipelineCreateInfo({}, stage, *layout));
  });
  return {bindings, push_bytes, std::move(set_layout), std::move(layout), std::move(pipeline)};
}

}  // namespace bisector::host
