// Failures on purpose, for tests.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "host/device/device.h"

namespace bisector::host {

enum class Fault { none, out_of_memory, device_lost };

// The `call`-th fallible Vulkan call from now on (from 0) fails with this; those before and after it do not.
void inject_fault(Fault fault, std::size_t call);
// Fallible calls since the last inject_fault().
std::size_t fallible_calls();
// From now on the names of such calls are appended here; null: nowhere.
void log_fallible_calls(std::vector<std::string>* names);

// From now on the device has no double precision, or binds no more bytes than this.
void hide_float64(Device& device);
void limit_storage_range(Device& device, std::size_t bytes);

}  // namespace bisector::host
