// Portable random numbers: the same on every platform and for any number of threads (std's distributions are neither).
#pragma once

#include <cstdint>

namespace bisector {

// SplitMix64 (Steele, Lea and Flood 2014). One generator per item, `stream` being the item's index, makes a parallel
// loop draw what a sequential one draws.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) : state_(mix(mix(seed + kGamma) + stream * kGamma)) {}

  std::uint64_t bits() { return mix(state_ += kGamma); }
  // In [0, 1), a multiple of 2^-53.
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

 private:
  static constexpr std::uint64_t kGamma = 0x9e3779b97f4a7c15u;
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
};

}  // namespace bisector
