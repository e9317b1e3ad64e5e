// Compute pipelines, made on demand and kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "host/device/cache_file.h"
#include "host/device/commands.h"
#include "host/device/vulkan.h"

namespace bisector::host {

struct Pipeline {
  std::size_t bindings;
  std::size_t push_bytes;
  vk::raii::DescriptorSetLayout set_layout;
  vk::raii::PipelineLayout layout;
  vk::raii::Pipeline pipeline;
};

// A kernel and what get() is asked for.
struct KernelUse {
  Kernel kernel;
  std::size_t bindings, push_bytes;
};

class Pipelines {
 public:
  // Starts from the file that BISECTOR_CACHE names, if it is good. Throws DeviceError.
  explicit Pipelines(const Device::Impl& device);
  // Writes the file if there is more to keep; that this fails is no matter.
  ~Pipelines();
  Pipelines(const Pipelines&) = delete;
  Pipelines& operator=(const Pipelines&) = delete;

  // The order in which the kernels of pipelines made from now on take their items (kernels/common.glsl).
  void set_order(std::uint32_t order) { order_ = order; }

  // Throws std::logic_error if there is no such kernel, or it was used before with other numbers; DeviceError.
  const Pipeline& get(const Kernel& kernel, std::size_t bindings, std::size_t push_bytes);
  // Those made so far, in alphabetical order.
  std::vector<KernelUse> used() const;

 private:
  struct Less {
    bool operator()(const Kernel& a, const Kernel& b) const;
  };

  Pipeline make(const Kernel& kernel, std::size_t bindings, std::size_t push_bytes) const;

  const Device::Impl& device_;
  CacheOwner owner_;
  std::filesystem::path file_;  // empty if there is none
  vk::raii::PipelineCache cache_;
  std::uint32_t order_ = 1;
  std::map<Kernel, Pipeline, Less> pipelines_;
};

}  // namespace bisector::host
