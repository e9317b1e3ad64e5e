// What is left of the device layer in a build without Vulkan.
#include "host/device/device.h"

namespace bisector::host {
namespace {
constexpr const char* kWithout = "built without Vulkan";
}

DeviceList list_devices() { return {.devices = {}, .problem = kWithout}; }
DeviceList list_gpus() { return list_devices(); }

struct Device::Impl {};

std::unique_ptr<Device> Device::open(const DeviceRequest& request) {
  throw DeviceError(word_of(request) + ": " + kWithout);
}
Device::~Device() = default;
const DeviceDescription& Device::description() const { throw DeviceError(kWithout); }

}  // namespace bisector::host
