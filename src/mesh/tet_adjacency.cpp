#include "mesh/tet_adjacency.h"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

#include "bisector/error.h"
#include "core/grouping.h"
#include "core/parallel.h"

namespace bisector {
namespace {

TetSide side_of(const std::vector<Tetrahedron>& tets, std::size_t at) {
  Triangle f = facet_of(tets[at / 4], static_cast<int>(at % 4));
  bool even = true;
  for (const auto& [i, j] : {std::pair{0, 1}, std::pair{1, 2}, std::pair{0, 1}})
    if (f[i] > f[j]) {
      std::swap(f[i], f[j]);
      even = !even;
    }
  return {f, even, at};
}

}  // namespace

// Those of each lowest vertex are few and quickly sorted.
std::vector<TetSide> sorted_sides(const std::vector<Tetrahedron>& tets) {
  Index vertices = 0;
  for (const Tetrahedron& t : tets) vertices = std::max(vertices, *std::max_element(t.begin(), t.end()) + 1);
  Csr<TetSide> sides = group_into_rows<TetSide>(vertices, [&](const auto& put) {
    for (std::size_t at = 0; at < 4 * tets.size(); ++at) {
      const TetSide side = side_of(tets, at);
      put(side.corners[0], side);
    }
  });
  parallel_each(
      vertices,
      [&](std::size_t v) {
        TetSide* const first = sides.values.data() + sides.offsets[v];
        std::sort(first, first + sides.size(v), [](const TetSide& a, const TetSide& b) {
          return std::tie(a.corners[1], a.corners[2], a.at) < std::tie(b.corners[1], b.corners[2], b.at);
        });
      },
      256);
  return std::move(sides.values);
}

std::vector<std::array<Index, 4>> tet_adjacency(const std::vector<Tetrahedron>& tets) {
  const std::vector<TetSide> sides = sorted_sides(tets);
  std::vector<std::array<Index, 4>> adjacent(tets.size(), {kNone, kNone, kNone, kNone});
  for (std::size_t k = 0; k + 1 < sides.size(); ++k) {
    const TetSide &a = sides[k], &b = sides[k + 1];
    if (a.corners != b.corners) continue;
    if (k + 2 < sides.size() && sides[k + 2].corners == a.corners)
      throw Error("the facet of the vertices " + std::to_string(a.corners[0]) + ", " + std::to_string(a.corners[1]) +
                  " and " + std::to_string(a.corners[2]) + " belongs to more than two tetrahedra");
    adjacent[a.at / 4][a.at % 4] = static_cast<Index>(b.at / 4);
    adjacent[b.at / 4][b.at % 4] = static_cast<Index>(a.at / 4);
  }
  return adjacent;
}

}  // namespace bisector
