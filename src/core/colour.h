// Colours as numbers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace bisector {

// The shares of red, green and blue in a full hue, which is given in turns: 0 is red, 1/3 green, 2/3 blue.
inline std::array<double, 3> shares_of_hue(double turns) {
  std::array<double, 3> shares;
  for (std::size_t k = 0; k < 3; ++k) {
    const double off = std::abs(std::remainder(turns - static_cast<double>(k) / 3, 1.0));
    shares[k] = std::clamp(2 - 6 * off, 0.0, 1.0);
  }
  return shares;
}

// A hue for each number, in turns, far from those of the numbers next to it.
inline double spread_hue(double number) {
  constexpr double kGoldenSection = 0.6180339887498949;
  const double turns = kGoldenSection * number;
  return turns - std::floor(turns);
}

// A channel of an sRGB colour as the share of light that it stands for (IEC 61966-2-1).
inline double light_of_srgb(unsigned char channel) {
  const double s = channel / 255.0;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

}  // namespace bisector
