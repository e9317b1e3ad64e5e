// How fallible Vulkan calls are made: each passes a checkpoint where tests inject failures (host/device/faults.h), and
// what it throws leaves as a DeviceError.
#pragma once

#include <string_view>
#include <utility>

#include "host/device/vulkan.h"

namespace bisector::host {

// Throws what inject_fault() asked for, if this is the call.
void checkpoint(std::string_view call);

// Throws the DeviceError for a failure of `call` on `device`.
[[noreturn]] void fail(std::string_view device, std::string_view call, const vk::SystemError& error);

template <class Function>
decltype(auto) attempt(std::string_view device, std::string_view call, Function&& function) {
  try {
    checkpoint(call);
    return std::forward<Function>(function)();
  } catch (const vk::SystemError& error) {
    fail(device, call, error);
  }
}

}  // namespace bisector::host
