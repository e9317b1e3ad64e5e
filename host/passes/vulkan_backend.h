// The backend that computes restricted Voronoi diagrams in compute shaders. Pairs and labels are those of CpuBackend;
// in double precision the moments are too, bit for bit.
#pragma once

#include <memory>

#include "backend/backend.h"
#include "host/device/device.h"
#include "host/passes/capacities.h"

namespace bisector::host {

struct VulkanOptions {
  Precision precision = Precision::automatic;
  NeighbourSource neighbours = NeighbourSource::nearest;
  bool double_rung = true;  // whether single precision may hand pairs to the double kernels; off in tests
  Capacities capacities = {};
};

// The surface must outlive the backend; the device may serve several, one at a time. Throws DeviceError; precision
// `double_` on a device without double does.
std::unique_ptr<Backend> make_vulkan_backend(const Surface& surface, std::shared_ptr<Device> device,
                                             const VulkanOptions& options);

}  // namespace bisector::host
