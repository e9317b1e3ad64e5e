// Whether a device computes as it promises, on values that tell. No driver is taken at its word.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/device/device.h"

namespace bisector::host {

// Why the device cannot be used; empty if + - * are right to one ulp, error terms and reciprocals to what the kernels'
// bounds allow, and subnormal numbers are kept or flushed to 0. Throws DeviceError.
std::string selftest_single(Device& device);

// Whether + - * round to nearest without contraction or flushing, conversions are exact and reciprocals correctly
// rounded. Throws DeviceError.
bool selftest_double(Device& device);

// What is tested in single precision, and what kernels/selftest.comp answers.
using SinglePair = std::array<float, 2>;
struct SingleResults {
  float sum, difference, product;
  std::array<float, 2> pair_sum, pair_product;  // high and low
  float reciprocal;                             // of the first
};
std::vector<SinglePair> single_pairs();
// What is wrong with them; empty if nothing is.
std::string fault_in_single(const SinglePair& pair, const SingleResults& results);

}  // namespace bisector::host
