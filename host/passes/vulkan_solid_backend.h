// The backend that computes clipped Voronoi diagrams in compute shaders. Pairs, polyhedra and dual are those of
// CpuSolidBackend; in double precision the moments are too, bit for bit.
#pragma once

#include <memory>

#include "backend/backend.h"
#include "host/passes/vulkan_backend.h"
#include "voronoi/clipped.h"

namespace bisector::host {

// The solid must outlive the backend. SolidCells::whole is only heeded where the density is uniform. Throws
// DeviceError; precision `double_` on a device without double does, and a solid of more tetrahedra than its buffers
// hold.
std::unique_ptr<SolidBackend> make_vulkan_solid_backend(const Solid& solid, std::shared_ptr<Device> device,
                                                        const VulkanOptions& options,
                                                        SolidCells how = SolidCells::whole);

}  // namespace bisector::host
