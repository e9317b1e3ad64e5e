// Which device computes diagrams: what there is, and a backend for what was asked for.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bisector/context.h"
#include "bisector/device.h"
#include "backend/backend.h"

namespace bisector {

// A backend for the surface, which must outlive it. Throws Error if the CPU cannot meet the request and DeviceError if a device
// cannot. If the request is automatic, a device that fails later is replaced by the CPU: a warning to `context`, whose functions
// must stay callable, and Backend::description() tell why.
std::unique_ptr<Backend> make_backend(const Surface& surface, const ComputeOptions& options, const Context& context = {});

// A backend for the solid, which must outlive it; otherwise as make_backend(Surface).
std::unique_ptr<SolidBackend> make_backend(const Solid& solid, const ComputeOptions& options, const Context& context = {});

}  // namespace bisector
