#include "tetmesh/carve.h"

#include <algorithm>
#include <array>
#include <utility>

#include "bisector/error.h"
#include "mesh/tet_adjacency.h"

namespace bisector {

namespace {

// The three rotations of a triangle are the same side of it.
Triangle rotated(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

}  // namespace

Carved carve(const std::vector<Tetrahedron>& tets, const std::vector<Triangle>& boundary) {
  std::vector<std::pair<Triangle, Index>> inner,
      outer;  // sides of boundary triangles, as facets of the tetrahedra there
  for (Index i = 0; i < boundary.size(); ++i) {
    const Triangle& t = boundary[i];
    inner.emplace_back(rotated(t), i);
    outer.emplace_back(rotated({t[0], t[2], t[1]}), i);
  }
  std::sort(inner.begin(), inner.end());
  std::sort(outer.begin(), outer.end());
  const auto find = [](const std::vector<std::pair<Triangle, Index>>& sides, const Triangle& facet) {
    const auto at = std::lower_bound(sides.begin(), sides.end(), std::pair(facet, Index{0}));
    return at != sides.end() && at->first == facet ? at->second : kNone;
  };

  enum : char { unknown, inside, outside };
  const std::vector<std::array<Index, 4>> adjacent = tet_adjacency(tets);
  std::vector<char> state(tets.size(), unknown), found(boundary.size(), 0);
  std::vector<std::array<bool, 4>> wall(tets.size(), {false, false, false, false});
  std::vector<Index> queue;
  const auto mark = [&](Index tet, char side) {
    if (state[tet] == side) return;
    if (state[tet] != unknown)
      throw Error("the surface does not separate inside from outside; it must be closed and oriented");
    state[tet] = side;
    queue.push_back(tet);
  };
  for (Index t = 0; t < tets.size(); ++t)
    for (int k = 0; k < 4; ++k) {
      const Triangle facet = rotated(facet_of(tets[t], k));
      const Index in = find(inner, facet), out = find(outer, facet);
      if (in == kNone && out == kNone) continue;
      wall[t][static_cast<std::size_t>(k)] = true;
      if (in != kNone) found[in] = 1;
      mark(t, in != kNone ? inside : outside);
    }
  Carved carved;
  for (Index i = 0; i < boundary.size(); ++i)
    if (!found[i]) carved.missing.push_back(i);
  if (!carved.missing.empty()) return carved;
  for (std::size_t head = 0; head < queue.size(); ++head) {
    const Index t = queue[head];
    for (std::size_t k = 0; k < 4; ++k) {
      if (wall[t][k]) continue;
      if (adjacent[t][k] != kNone)
        mark(adjacent[t][k], state[t]);
      else if (state[t] == inside)
        throw Error("the tetrahedra do not fill the surface; please report this as a bug");
    }
  }
  for (Index t = 0; t < tets.size(); ++t)
    if (state[t] == inside) carved.tets.push_back(tets[t]);
  return carved;
}

}  // namespace bisector
