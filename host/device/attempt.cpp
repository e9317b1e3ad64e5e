#include "host/device/attempt.h"

#include <atomic>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "host/device/faults.h"

namespace bisector::host {
namespace {

std::atomic<Fault> injected{Fault::none};
std::atomic<std::size_t> failing_call{0};
std::atomic<std::size_t> calls{0};
std::vector<std::string>* log = nullptr;

std::string what_and_remedy(vk::Result result, std::string_view call) {
  const std::string at = " (" + std::string(call) + ")";
  switch (result) {
    case vk::Result::eErrorOutOfDeviceMemory: return "out of device memory" + at + "; free some";
    case vk::Result::eErrorOutOfHostMemory: return "out of host memory" + at + "; free some";
    case vk::Result::eErrorDeviceLost:
      return "the device was lost" + at + ", and the system's log may tell why; run again";
    default: return vk::to_string(result) + at + "; update the driver";
  }
}

}  // namespace

void inject_fault(Fault fault, std::size_t call) {
  injected = Fault::none;
  failing_call = call;
  calls = 0;
  injected = fault;
}

std::size_t fallible_calls() { return calls; }

void log_fallible_calls(std::vector<std::string>* names) { log = names; }

void checkpoint(std::string_view name) {
  if (log) log->emplace_back(name);
  const std::size_t call = calls++;
  const Fault fault = injected;
  if (fault == Fault::none || call != failing_call) return;
  if (fault == Fault::out_of_memory) throw vk::OutOfDeviceMemoryError("injected");
  throw vk::DeviceLostError("injected");
}

void fail(std::string_view device, std::string_view call, const vk::SystemError& error) {
  throw DeviceError(std::string(device) + ": " + what_and_remedy(static_cast<vk::Result>(error.code().value()), call));
}

}  // namespace bisector::host
