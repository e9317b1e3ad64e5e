// Which tetrahedra share a facet.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector {

// Corners of the facet opposite corner k, counter-clockwise seen from outside a positively oriented tetrahedron.
inline constexpr int kFacetCorners[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

inline Triangle facet_of(const Tetrahedron& tet, int k) {
  return {tet[kFacetCorners[k][0]], tet[kFacetCorners[k][1]], tet[kFacetCorners[k][2]]};
}

// A facet as one of its tetrahedra has it.
struct TetSide {
  Triangle corners;  // ascending
  bool even;         // facet_of() is an even permutation of them
  std::size_t at;    // 4 times the tetrahedron, plus the facet
};

// The sides of all facets, by corners, then tetrahedra.
std::vector<TetSide> sorted_sides(const std::vector<Tetrahedron>& tets);

// For each tetrahedron and each of its facets the tetrahedron on the other side, or kNone on the boundary. Throws
// Error, naming the first, if a facet has more than two tetrahedra.
std::vector<std::array<Index, 4>> tet_adjacency(const std::vector<Tetrahedron>& tets);

// What hangs together through the facets k of tetrahedra t for which joined(t, k) holds; it is asked of facets with a
// tetrahedron on the other side only. The part of each tetrahedron, numbered by their first ones.
template <class Joined>
std::vector<Index> tet_parts(const std::vector<std::array<Index, 4>>& adjacent, const Joined& joined) {
  std::vector<Index> part(adjacent.size(), kNone), stack;
  Index parts = 0;
  for (Index first = 0; first < part.size(); ++first) {
    if (part[first] != kNone) continue;
    part[first] = parts++;
    stack.assign(1, first);
    while (!stack.empty()) {
      const Index t = stack.back();
      stack.pop_back();
      for (std::size_t k = 0; k < 4; ++k) {
        const Index other = adjacent[t][k];
        if (other == kNone || part[other] != kNone || !joined(t, k)) continue;
        part[other] = part[t];
        stack.push_back(other);
      }
    }
  }
  return part;
}

}  // namespace bisector
