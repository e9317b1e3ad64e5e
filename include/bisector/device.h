// Where diagrams are computed: devices, precision, and what an evaluation reports of itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bisector/cells.h"
#include "bisector/export.h"

namespace bisector {

enum class Precision {
  automatic,  // double where the device computes in double, else single
  single,
  double_,
};

// Which device is to compute.
struct DeviceRequest {
  enum class Kind {
    automatic,  // the best GPU, or the CPU if there is none or it fails
    cpu,
    vulkan,  // the Vulkan device that `index` or `uuid` names, or else the best one, and no other
  };

  Kind kind = Kind::automatic;
  std::optional<unsigned> index = {};  // DeviceDescription::index
  std::string uuid = {};               // DeviceDescription::uuid; empty: none given

  bool operator==(const DeviceRequest&) const = default;
};

// Reads "auto", "cpu", "vulkan", "vulkan:INDEX" or "vulkan:UUID". Throws Error for anything else.
BISECTOR_API DeviceRequest parse_device(std::string_view word);
// The word that parse_device() reads.
BISECTOR_API std::string word_of(const DeviceRequest& request);

struct ComputeOptions {
  DeviceRequest device;
  Precision precision = Precision::automatic;
  NeighbourSource neighbours = NeighbourSource::nearest;
};

// A Vulkan device as `bisector devices` lists it.
struct DeviceDescription {
  unsigned index = 0;  // in the loader's order
  std::string uuid;    // 32 hexadecimal digits in groups of 8-4-4-4-12
  std::string name;
  std::string kind;                   // "discrete", "integrated", "virtual", "software" or "other"
  std::string driver;                 // name and version
  std::string api;                    // "1.3.230"
  std::uint64_t memory = 0;           // bytes, of the largest device-local heap
  bool float64 = false;               // double precision that passed the self-test
  std::vector<std::string> features;  // optional ones that Bisector uses: "float64", ...
  std::string rejected;               // why it cannot be used; empty if it can
};

struct DeviceList {
  std::vector<DeviceDescription> devices;
  std::string problem;  // why there are none: no loader, no driver, built without Vulkan
};

// Never throws for lack of a loader, a driver or a device.
BISECTOR_API DeviceList list_devices();

// The best usable device of a list that is not software; nothing if there is none. With `double_` only those count that
// have it.
BISECTOR_API std::optional<DeviceRequest> best_gpu(DeviceList list, Precision precision = Precision::automatic);

struct BackendDescription {
  std::string name;  // of the processor or device
  std::string kind;  // "cpu", "ranks" of MPI, or a device's: "discrete", "integrated", "virtual", "software", "other"
  std::string precision;  // "single" or "double"
  std::string fallback;   // why a device was given up for this one; empty if none was
};

// Seconds on a device, from its own clock; all 0 where the CPU computed. `descent` are the vectors of the optimiser.
struct DeviceSeconds {
  double transfer = 0, grid = 0, neighbours = 0, owners = 0, clip = 0, sort = 0, sum = 0, descent = 0;
};

// What evaluations asked of a device: submissions, each with a wait, dispatches of kernels, and bytes moved to it and
// back; and the seconds of the host in them, which are all but the device's own. All 0 where the CPU computed.
struct DeviceWork {
  std::size_t submits = 0, dispatches = 0;
  std::size_t bytes_up = 0, bytes_down = 0;
  double host_seconds = 0;
};

// Seconds of an evaluation: for the Delaunay triangulation or the nearest seeds, for who meets whom, and for clipping.
struct DiagramSeconds {
  double delaunay = 0, neighbours = 0, pairs = 0, clip = 0;
  DeviceSeconds device;  // within those above
};

// How the pairs of a diagram were certified.
struct Certification {
  std::size_t pairs = 0;
  std::size_t uncertain = 0;  // a decision, or a cell's mass in single precision, was within its error bound at first
  std::size_t wider = 0;      // needed a longer list of neighbours
  std::size_t doubled = 0;    // of a device: uncertain in single precision and clipped anew in double
  std::size_t cpu = 0;        // settled by the CPU's exact arithmetic
};

// What an evaluation of a diagram reports of itself.
struct EvaluationReport {
  Certification certification;
  DiagramSeconds seconds;
  DeviceWork device_work;
};

}  // namespace bisector
