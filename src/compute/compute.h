// Which device computes diagrams: what there is, and backends for what was asked for.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "backend/backend.h"
#include "bisector/context.h"
#include "bisector/device.h"

namespace bisector {

class Ranks;

namespace host {
class Device;
}

// Lets backends for surfaces that are made from now on divide their work among these ranks, whose CPUs compute; null:
// no longer. Only a process that is rank 0 of a run calls it, before and after all that it computes. A request for a
// Vulkan device is met by rank 0 alone.
void set_ranks(Ranks* ranks);
// Those that were set last; null: none.
Ranks* ranks_of_run();

// Where a run computes. All backends of a run come from here: the device is chosen and opened once, and stays open for
// as long as one of them lives. Backends of one device may take turns but not compute at the same time.
class Compute {
 public:
  // Throws Error if the CPU is to compute in single precision. If the request is automatic, a backend whose device
  // fails is replaced by the CPU: a warning to `context`, whose functions must stay callable, and
  // Backend::description() tell why.
  explicit Compute(const ComputeOptions& options, const Context& context = {});

  // A backend for a domain, which must outlive it. Throws DeviceError if an exact request cannot be met.
  std::unique_ptr<Backend> backend(const Surface& surface);
  std::unique_ptr<SolidBackend> backend(const Solid& solid);

 private:
  void choose_best();
  template <class Domain>
  auto make(const Domain& domain);
  template <class Domain>
  auto make_on_device(const Domain& domain);
  void warn(const std::string& failure);

  ComputeOptions options_;
  Context context_;
  std::optional<DeviceRequest> device_;  // to open; none: the CPU
  std::string failure_;                  // why the CPU computes although there is a GPU
  std::string warned_;                   // the last failure that was warned of
  std::shared_ptr<host::Device> opened_;
};

// The only backend of a run.
std::unique_ptr<Backend> make_backend(const Surface& surface, const ComputeOptions& options,
                                      const Context& context = {});
std::unique_ptr<SolidBackend> make_backend(const Solid& solid, const ComputeOptions& options,
                                           const Context& context = {});

}  // namespace bisector
