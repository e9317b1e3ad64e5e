#include "mesh/tet_adjacency.h"

#include <algorithm>

#include "bisector/error.h"

namespace bisector {

std::vector<std::array<Index, 4>> tet_adjacency(const std::vector<Tetrahedron>& tets) {
  struct Side {
    Triangle corners;  // ascending
    Index tet;
    int facet;
  };
  std::vector<Side> sides;
  sides.reserve(4 * tets.size());
  for (Index t = 0; t < tets.size(); ++t)
    for (int k = 0; k < 4; ++k) {
      Triangle corners = facet_of(tets[t], k);
      std::sort(corners.begin(), corners.end());
      sides.push_back({corners, t, k});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.tet < b.tet;
  });
  std::vector<std::array<Index, 4>> adjacent(tets.size(), {kNone, kNone, kNone, kNone});
  for (std::size_t k = 0; k + 1 < sides.size(); ++k) {
    const Side &a = sides[k], &b = sides[k + 1];
    if (a.corners != b.corners) continue;
    if (k + 2 < sides.size() && sides[k + 2].corners == a.corners)
      throw Error("the facet of the vertices " + std::to_string(a.corners[0]) + ", " + std::to_string(a.corners[1]) +
                  " and " + std::to_string(a.corners[2]) + " belongs to more than two tetrahedra");
    adjacent[a.tet][static_cast<std::size_t>(a.facet)] = b.tet;
    adjacent[b.tet][static_cast<std::size_t>(b.facet)] = a.tet;
  }
  return adjacent;
}

}  // namespace bisector
