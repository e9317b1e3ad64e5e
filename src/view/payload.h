// A scene and a report as bytes for the page's script (viewer/src/payload.ts).
#pragma once

#include <cstddef>
#include <string>

#include "view/scene.h"

namespace bisector::view {

// What a browser still turns without stuttering; more is simplified.
struct Limits {
  std::size_t triangles = 250'000, tets = 400'000, points = 300'000;  // of each model
};

// zlib's format. Inside: the length of a JSON header in four bytes, lowest first, the header, and the arrays that it
// refers to by [offset, count]. An array is integers, each the difference from the one `stride` before it, with the
// sign in the lowest bit, in bytes of seven bits, lowest first, all but the last with the eighth bit set. `report` is
// text of its own.
std::string encode(const Scene& scene, const std::string& report, const Limits& limits = {});

}  // namespace bisector::view
