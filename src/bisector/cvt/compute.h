// Which device computes diagrams: what there is, and a backend for what was asked for.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bisector/core/context.h"
#include "bisector/cvt/backend.h"

namespace bisector {

enum class Precision {
  automatic,  // double where the device computes in double, else single
  single,
  double_,
};

struct ComputeOptions {
  // "cpu"; "vulkan" (the best device), "vulkan:INDEX" or "vulkan:UUID" (that very one); or "auto": the best GPU, or the CPU if
  // there is none or it fails.
  std::string device = "auto";
  Precision precision = Precision::automatic;
  NeighbourSource neighbours = NeighbourSource::nearest;
};

// A Vulkan device as `bisector devices` lists it.
struct DeviceDescription {
  unsigned index = 0;        // in the loader's order
  std::string uuid;          // 32 hexadecimal digits in groups of 8-4-4-4-12
  std::string name;
  std::string kind;          // "discrete", "integrated", "virtual", "software" or "other"
  std::string driver;        // name and version
  std::string api;           // "1.3.230"
  std::uint64_t memory = 0;  // bytes, of the largest device-local heap
  bool float64 = false;      // double precision that passed the self-test
  std::vector<std::string> features;  // optional ones that Bisector uses: "float64", ...
  std::string rejected;      // why it cannot be used; empty if it can
};

struct DeviceList {
  std::vector<DeviceDescription> devices;
  std::string problem;       // why there are none: no loader, no driver, built without Vulkan
};

// Never throws for lack of a loader, a driver or a device.
DeviceList list_devices();

// The word for the best usable device of a list that is not software, "vulkan:INDEX"; empty if there is none. With `double_`
// only those count that have it.
std::string best_gpu(DeviceList list, Precision precision = Precision::automatic);

// A backend for the surface, which must outlive it. Throws Error if the words cannot be understood and DeviceError if an exact
// request cannot be met. With "auto" a device that fails later is replaced by the CPU: a warning to `context`, whose functions
// must stay callable, and Backend::description() tell why.
std::unique_ptr<Backend> make_backend(const Surface& surface, const ComputeOptions& options, const Context& context = {});

}  // namespace bisector
