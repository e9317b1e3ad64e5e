// A device's diagrams against the CPU's, on small generated models that are hard in different ways.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bisector/context.h"
#include "check/parity.h"
#include "compute/compute.h"

namespace bisector {

// What rounding may do to cells and to the sum of their masses, as Parity measures it.
struct ParityLimits {
  double cells, sum;
};
ParityLimits parity_limits(const BackendDescription& device);

// One model, set of seeds, source of neighbours and precision.
struct DeviceCheckRow {
  std::string model, seeds;
  NeighbourSource neighbours = NeighbourSource::nearest;
  BackendDescription device;
  std::size_t triangles = 0, seed_count = 0;  // triangles of the surface, or the solid's boundary
  std::size_t tets = 0;                       // of a solid
  Parity parity;                              // with the CPU
  Certification certification;                // of the device's diagram
  bool repeats = false;                       // the same to the last bit after another diagram in between
  double seconds = 0, cpu_seconds = 0;        // of a later evaluation of the moments
  bool passed = false;
};

// Checks the device of a request, which must not be automatic, in one precision, or with `automatic` in all it has.
// Each row is handed out as it is done. Throws Error and DeviceError as make_backend does, and Cancelled.
std::vector<DeviceCheckRow> check_device(const DeviceRequest& device, Precision precision, const Context& context,
                                         const std::function<void(const DeviceCheckRow&)>& done);

}  // namespace bisector
