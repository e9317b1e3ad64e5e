#include "compute/compute.h"

#include <fmt/format.h>

#include <utility>

#include "backend/cpu_backend.h"
#include "backend/fallback_backend.h"
#include "bisector/error.h"
#include "distributed/distributed_backend.h"
#include "host/device/ranking.h"
#include "host/passes/vulkan_backend.h"
#include "host/passes/vulkan_solid_backend.h"

namespace bisector {
namespace {

Ranks* set_last = nullptr;

// What the two kinds of domain differ in.
std::unique_ptr<Backend> cpu_backend(const Surface& surface, NeighbourSource source, std::string fallback) {
  if (set_last) return std::make_unique<DistributedBackend>(surface, source, *set_last);
  return std::make_unique<CpuBackend>(surface, source, std::move(fallback));
}
std::unique_ptr<SolidBackend> cpu_backend(const Solid& solid, NeighbourSource source, std::string fallback) {
  return std::make_unique<CpuSolidBackend>(solid, source, SolidCells::whole, std::move(fallback));
}

std::unique_ptr<Backend> device_backend(const Surface& surface, std::shared_ptr<host::Device> device,
                                        const host::VulkanOptions& options) {
  return host::make_vulkan_backend(surface, std::move(device), options);
}
std::unique_ptr<SolidBackend> device_backend(const Solid& solid, std::shared_ptr<host::Device> device,
                                             const host::VulkanOptions& options) {
  return host::make_vulkan_solid_backend(solid, std::move(device), options);
}

std::unique_ptr<Backend> with_fallback(std::unique_ptr<Backend> device, NeighbourSource source,
                                       const Context& context) {
  return std::make_unique<FallbackBackend>(std::move(device), source, context);
}
std::unique_ptr<SolidBackend> with_fallback(std::unique_ptr<SolidBackend> device, NeighbourSource source,
                                            const Context& context) {
  return std::make_unique<FallbackSolidBackend>(std::move(device), source, context);
}

void check_cpu_precision(Precision precision) {
  if (precision == Precision::single)
    throw Error("the CPU computes in double precision only", Reason::no_single_precision);
}

}  // namespace

void set_ranks(Ranks* ranks) { set_last = ranks; }
Ranks* ranks_of_run() { return set_last; }

DeviceList list_devices() { return host::list_devices(); }

std::optional<DeviceRequest> best_gpu(DeviceList list, Precision precision) {
  if (precision == Precision::double_)
    std::erase_if(list.devices, [](const DeviceDescription& device) { return !device.float64; });
  const DeviceDescription* best = host::best_gpu(list);
  if (!best) return {};
  return DeviceRequest{.kind = DeviceRequest::Kind::vulkan, .index = best->index};
}

Compute::Compute(const ComputeOptions& options, const Context& context) : options_(options), context_(context) {
  switch (options_.device.kind) {
    case DeviceRequest::Kind::automatic: choose_best(); break;
    case DeviceRequest::Kind::cpu: check_cpu_precision(options_.precision); break;
    case DeviceRequest::Kind::vulkan: device_ = options_.device; break;
  }
}

void Compute::choose_best() {
  if (set_last) return check_cpu_precision(options_.precision);
  const DeviceList list = host::list_gpus();
  device_ = best_gpu(list, options_.precision);
  if (device_) return;
  const std::optional<DeviceRequest> other = best_gpu(list);
  if (!other) return check_cpu_precision(options_.precision);
  failure_ = fmt::format("{}: the device has no double precision", word_of(*other));
}

template <class Domain>
auto Compute::make_on_device(const Domain& domain) {
  host::VulkanOptions vulkan;
  vulkan.precision = options_.precision;
  vulkan.neighbours = options_.neighbours;
  if (opened_) try {
      return device_backend(domain, opened_, vulkan);
    } catch (const DeviceError&) {
      // The device may have been lost to another backend; it is opened anew.
    }
  opened_ = host::Device::open(*device_);
  return device_backend(domain, opened_, vulkan);
}

template <class Domain>
auto Compute::make(const Domain& domain) {
  if (device_ && options_.device.kind == DeviceRequest::Kind::vulkan) return make_on_device(domain);
  std::string failure = failure_;
  if (device_) try {
      return with_fallback(make_on_device(domain), options_.neighbours, context_);
    } catch (const DeviceError& error) {
      failure = error.what();
    }
  if (!failure.empty()) warn(failure);
  return cpu_backend(domain, options_.neighbours, failure);
}

void Compute::warn(const std::string& failure) {
  if (failure == warned_) return;
  warned_ = failure;
  context_.warn("computing on the CPU because of this: " + failure);
}

std::unique_ptr<Backend> Compute::backend(const Surface& surface) { return make(surface); }
std::unique_ptr<SolidBackend> Compute::backend(const Solid& solid) { return make(solid); }

std::unique_ptr<Backend> make_backend(const Surface& surface, const ComputeOptions& options, const Context& context) {
  return Compute(options, context).backend(surface);
}

std::unique_ptr<SolidBackend> make_backend(const Solid& solid, const ComputeOptions& options, const Context& context) {
  return Compute(options, context).backend(solid);
}

}  // namespace bisector
