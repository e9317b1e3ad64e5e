// A Vulkan 1.2 device, opened through a loader that is found at run time. No Vulkan types are visible outside
// host/device/.
//
// Environment variables: BISECTOR_CACHE names a file or folder to keep compiled pipelines in (nothing is kept without
// it); BISECTOR_VULKAN_VALIDATION=1 or 2 enables the validation layers; BISECTOR_VULKAN_LOADER names another loader
// than libvulkan.so.1; BISECTOR_KERNEL_TIMES names a CSV file for the time that each kernel took, written when the
// device is closed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bisector/device.h"
#include "bisector/error.h"

namespace bisector::host {

// Never throws for lack of a loader, a driver or a device.
DeviceList list_devices();
// Without software devices, which are not opened: their drivers compile for a while, and crash where memory is limited.
DeviceList list_gpus();

struct DeviceLimits {
  std::size_t storage_range = 0;      // bytes of one storage buffer binding
  std::size_t storage_alignment = 0;  // of a binding's offset
  std::uint32_t groups = 0;           // workgroups in one dimension
};

// One queue of one device, with its pipelines (made on demand and kept) and pools. Not to be shared between threads.
// Everything that may fail throws DeviceError with one line; after that the object is only good for destruction.
class Device {
 public:
  // Of the request, which must be of the kind `vulkan`. Throws DeviceError that says which devices there are.
  static std::unique_ptr<Device> open(const DeviceRequest& request = {.kind = DeviceRequest::Kind::vulkan});
  ~Device();

  const DeviceDescription& description() const;
  const DeviceLimits& limits() const;

  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  explicit Device(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace bisector::host
