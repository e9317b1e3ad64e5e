#include "compute/compute.h"

#include <fmt/format.h>

#include <utility>

#include "bisector/error.h"
#include "backend/cpu_backend.h"
#include "backend/fallback_backend.h"
#include "host/device/ranking.h"
#include "host/passes/vulkan_backend.h"
#include "host/passes/vulkan_solid_backend.h"

namespace bisector {
namespace {

// What the two kinds of domain differ in.
std::unique_ptr<Backend> cpu_backend(const Surface& surface, NeighbourSource source, std::string fallback) {
  return std::make_unique<CpuBackend>(surface, source, std::move(fallback));
}
std::unique_ptr<SolidBackend> cpu_backend(const Solid& solid, NeighbourSource source, std::string fallback) {
  return std::make_unique<CpuSolidBackend>(solid, source, InnerCells::whole, std::move(fallback));
}

std::unique_ptr<Backend> device_backend(const Surface& surface, const DeviceRequest& device,
                                        const host::VulkanOptions& options) {
  return host::make_vulkan_backend(surface, host::Device::open(device), options);
}
std::unique_ptr<SolidBackend> device_backend(const Solid& solid, const DeviceRequest& device,
                                             const host::VulkanOptions& options) {
  return host::make_vulkan_solid_backend(solid, host::Device::open(device), options);
}

std::unique_ptr<Backend> with_fallback(std::unique_ptr<Backend> device, NeighbourSource source, const Context& context) {
  return std::make_unique<FallbackBackend>(std::move(device), source, context);
}
std::unique_ptr<SolidBackend> with_fallback(std::unique_ptr<SolidBackend> device, NeighbourSource source,
                                            const Context& context) {
  return std::make_unique<FallbackSolidBackend>(std::move(device), source, context);
}

template <class Domain>
auto make_cpu_backend(const Domain& domain, const ComputeOptions& options) {
  if (options.precision == Precision::single)
    throw Error("the CPU computes in double precision only", Reason::no_single_precision);
  return cpu_backend(domain, options.neighbours, {});
}

template <class Domain>
auto make_device_backend(const Domain& domain, const DeviceRequest& device, const ComputeOptions& options) {
  host::VulkanOptions vulkan;
  vulkan.precision = options.precision;
  vulkan.neighbours = options.neighbours;
  return device_backend(domain, device, vulkan);
}

// The best GPU for as long as it works.
template <class Domain>
auto make_best_backend(const Domain& domain, const ComputeOptions& options, const Context& context) {
  const DeviceList list = list_devices();
  std::string failure;
  if (const auto gpu = best_gpu(list, options.precision)) {
    try {
      return with_fallback(make_device_backend(domain, *gpu, options), options.neighbours, context);
    } catch (const DeviceError& error) {
      failure = error.what();
    }
  } else if (const auto other = best_gpu(list)) {
    failure = fmt::format("{}: the device has no double precision", word_of(*other));
  } else {
    return make_cpu_backend(domain, options);
  }
  context.warn("computing on the CPU because of this: " + failure);
  return cpu_backend(domain, options.neighbours, failure);
}

template <class Domain>
auto make_backend_for(const Domain& domain, const ComputeOptions& options, const Context& context) {
  switch (options.device.kind) {
    case DeviceRequest::Kind::automatic: return make_best_backend(domain, options, context);
    case DeviceRequest::Kind::cpu: return make_cpu_backend(domain, options);
    case DeviceRequest::Kind::vulkan: break;
  }
  return make_device_backend(domain, options.device, options);
}

}  // namespace

std::optional<DeviceRequest> best_gpu(DeviceList list, Precision precision) {
  if (precision == Precision::double_)
    std::erase_if(list.devices, [](const DeviceDescription& device) { return !device.float64; });
  const DeviceDescription* best = host::best_gpu(list);
  if (!best) return {};
  return DeviceRequest{.kind = DeviceRequest::Kind::vulkan, .index = best->index};
}

std::unique_ptr<Backend> make_backend(const Surface& surface, const ComputeOptions& options, const Context& context) {
  return make_backend_for(surface, options, context);
}

std::unique_ptr<SolidBackend> make_backend(const Solid& solid, const ComputeOptions& options, const Context& context) {
  return make_backend_for(solid, options, context);
}

}  // namespace bisector
