// The triangles around vertices of a mesh that changes, and its edges as keys.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// The same whichever end comes first.
inline std::uint64_t edge_key(Index a, Index b) { return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

inline bool has_corner(const Triangle& t, Index v) { return t[0] == v || t[1] == v || t[2] == v; }

// The other corners of these triangles at a vertex, ascending.
inline std::vector<Index> neighbours_in_star(const std::vector<Triangle>& triangles, const std::vector<Index>& star,
                                             Index vertex) {
  std::vector<Index> found;
  for (const Index t : star)
    for (const Index v : triangles[t])
      if (v != vertex) found.push_back(v);
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace bisector
