// What is left of the host layer in a build without Vulkan.
#include "host/device/device.h"
#include "host/passes/vulkan_backend.h"
#include "host/passes/vulkan_solid_backend.h"

namespace bisector {
namespace {
constexpr const char* kWithout = "built without Vulkan";
}

DeviceList list_devices() { return {.devices = {}, .problem = kWithout}; }

namespace host {

struct Device::Impl {};

std::unique_ptr<Device> Device::open(const DeviceRequest& request) {
  throw DeviceError(word_of(request) + ": " + kWithout);
}
Device::~Device() = default;
const DeviceDescription& Device::description() const { throw DeviceError(kWithout); }

std::unique_ptr<Backend> make_vulkan_backend(const Surface&, std::unique_ptr<Device>, const VulkanOptions&) {
  throw DeviceError(kWithout);
}

std::unique_ptr<SolidBackend> make_vulkan_solid_backend(const Solid&, std::unique_ptr<Device>, const VulkanOptions&,
                                                        InnerCells) {
  throw DeviceError(kWithout);
}

}  // namespace host
}  // namespace bisector
