// Whether a device computes as it promises, on values that tell. No driver is taken at its word.
#pragma once

#include <string>

#include "host/device/device.h"

namespace bisector::host {

// Why the device cannot be used; empty if + - * are right to one ulp. Throws DeviceError.
std::string selftest_single(Device& device);

// Whether + - * round to nearest without contraction or flushing, and conversions are exact. Throws DeviceError.
bool selftest_double(Device& device);

}  // namespace bisector::host
