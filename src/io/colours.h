// Colours by which labels are told apart.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "bisector/io.h"

namespace bisector::io {

// That of the options, else one whose hue is far from those of the labels next to it.
inline std::array<unsigned char, 3> colour_of_label(std::int32_t label, const WriteOptions& options) {
  if (!options.colours.empty()) return options.colours[static_cast<std::size_t>(label)];
  constexpr double kGolden = 0.6180339887498949, kDarkest = 0.55, kLightest = 0.95;
  const double turn = kGolden * static_cast<double>(static_cast<std::uint32_t>(label)), hue = turn - std::floor(turn);
  std::array<unsigned char, 3> colour{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double away = std::abs(hue - static_cast<double>(k) / 3), least = std::min(away, 1 - away);  // of 0 to 0.5
    const double share = std::clamp(2 - 6 * least, 0.0, 1.0);
    colour[k] = static_cast<unsigned char>(std::lround(255 * (kDarkest + (kLightest - kDarkest) * share)));
  }
  return colour;
}

}  // namespace bisector::io
