// The backends of a build without Vulkan, where no device can be opened for them.
#include <stdexcept>

#include "host/passes/vulkan_backend.h"
#include "host/passes/vulkan_solid_backend.h"

namespace bisector::host {

std::unique_ptr<Backend> make_vulkan_backend(const Surface&, std::shared_ptr<Device>, const VulkanOptions&) {
  throw std::logic_error("a build without Vulkan has opened a device");
}

std::unique_ptr<SolidBackend> make_vulkan_solid_backend(const Solid&, std::shared_ptr<Device>, const VulkanOptions&,
                                                        SolidCells) {
  throw std::logic_error("a build without Vulkan has opened a device");
}

}  // namespace bisector::host
