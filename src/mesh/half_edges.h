// Half-edge 3 t + k runs from corner k of triangle t to the next corner, which has the index 3 t + (k + 1) % 3.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// The vertices of an edge, the lower one first.
inline std::array<Index, 2> ascending(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

inline std::size_t next_half_edge(std::size_t half_edge) { return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1; }

// The vertex that a half-edge begins at.
inline Index origin(const std::vector<Triangle>& triangles, std::size_t half_edge) {
  return triangles[half_edge / 3][half_edge % 3];
}

// The corner of the half-edge's triangle that lies at an end of its edge.
inline std::size_t corner_at(const std::vector<Triangle>& triangles, std::size_t half_edge, Index vertex) {
  return origin(triangles, half_edge) == vertex ? half_edge : next_half_edge(half_edge);
}

}  // namespace bisector
