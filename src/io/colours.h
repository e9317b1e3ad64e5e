// Colours by which labels are told apart.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "bisector/io.h"
#include "core/colour.h"

namespace bisector::io {

// That of the options, else one whose hue is far from those of the labels next to it.
inline std::array<unsigned char, 3> colour_of_label(std::int32_t label, const WriteOptions& options) {
  if (!options.colours.empty()) return options.colours[static_cast<std::size_t>(label)];
  constexpr double kDarkest = 0.55, kLightest = 0.95;
  const std::array<double, 3> shares = shares_of_hue(spread_hue(static_cast<std::uint32_t>(label)));
  std::array<unsigned char, 3> colour{};
  for (std::size_t k = 0; k < 3; ++k)
    colour[k] = static_cast<unsigned char>(std::lround(255 * (kDarkest + (kLightest - kDarkest) * shares[k])));
  return colour;
}

}  // namespace bisector::io
