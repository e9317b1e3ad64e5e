#include "bisector/cvt/compute.h"

#include <fmt/format.h>

#include <utility>

#include "bisector/core/error.h"
#include "bisector/cvt/cpu_backend.h"
#include "bisector/cvt/fallback_backend.h"
#include "host/ranking.h"
#include "host/vulkan_backend.h"

namespace bisector {
namespace {

std::unique_ptr<Backend> make_cpu_backend(const Surface& surface, const ComputeOptions& options) {
  if (options.precision == Precision::single)
    throw Error("--precision single: the CPU computes in double precision only; use --precision double or a device");
  return std::make_unique<CpuBackend>(surface, options.neighbours);
}

std::unique_ptr<Backend> make_device_backend(const Surface& surface, const std::string& device,
                                             const ComputeOptions& options) {
  host::VulkanOptions vulkan;
  vulkan.precision = options.precision;
  vulkan.neighbours = options.neighbours;
  return host::make_vulkan_backend(surface, host::Device::open(device), vulkan);
}

// The best GPU for as long as it works.
std::unique_ptr<Backend> make_best_backend(const Surface& surface, const ComputeOptions& options, const Context& context) {
  const DeviceList list = list_devices();
  const std::string gpu = best_gpu(list, options.precision);
  std::string failure;
  if (!gpu.empty()) {
    try {
      return std::make_unique<FallbackBackend>(make_device_backend(surface, gpu, options), options.neighbours, context);
    } catch (const DeviceError& error) {
      failure = error.what();
    }
  } else if (const std::string other = best_gpu(list); !other.empty()) {
    failure = fmt::format("--device {}: the device has no double precision", other);
  } else {
    return make_cpu_backend(surface, options);
  }
  context.warn("computing on the CPU because of this: " + failure);
  return std::make_unique<CpuBackend>(surface, options.neighbours, failure);
}

}  // namespace

std::string best_gpu(DeviceList list, Precision precision) {
  if (precision == Precision::double_)
    std::erase_if(list.devices, [](const DeviceDescription& device) { return !device.float64; });
  const DeviceDescription* best = host::best_gpu(list);
  return best ? fmt::format("vulkan:{}", best->index) : "";
}

std::unique_ptr<Backend> make_backend(const Surface& surface, const ComputeOptions& options, const Context& context) {
  if (options.device == "auto") return make_best_backend(surface, options, context);
  if (options.device == "cpu") return make_cpu_backend(surface, options);
  if (options.device.starts_with("vulkan")) return make_device_backend(surface, options.device, options);
  throw Error(fmt::format("--device {}: is none of auto, cpu, vulkan, vulkan:INDEX, vulkan:UUID", options.device));
}

}  // namespace bisector
