#include "tetmesh/carve.h"

#include <algorithm>
#include <array>
#include <utility>

#include "bisector/error.h"
#include "core/grouping.h"
#include "mesh/tet_adjacency.h"

namespace bisector {

namespace {

// Which triangle of a boundary a facet is, and on which side of it. Few triangles share their lowest vertex.
class Sides {
 public:
  explicit Sides(const std::vector<Triangle>& triangles) {
    Index vertices = 0;
    for (const Triangle& t : triangles) vertices = std::max(vertices, *std::max_element(t.begin(), t.end()) + 1);
    by_lowest_ = group_into_rows<Side>(vertices, [&](const auto& put) {
      for (Index i = 0; i < triangles.size(); ++i) {
        const Triangle t = rotated(triangles[i]);
        put(t[0], Side{t[1], t[2], i});
      }
    });
  }
  struct Found {
    Index inner = kNone, outer = kNone;  // triangles of which the facet is that side
  };
  Found find(const Triangle& facet) const {
    const Triangle t = rotated(facet);
    Found found;
    if (t[0] >= by_lowest_.rows()) return found;
    for (const Side* side = by_lowest_.begin(t[0]); side != by_lowest_.end(t[0]); ++side) {
      if (side->b == t[1] && side->c == t[2]) found.inner = std::min(found.inner, side->triangle);
      if (side->b == t[2] && side->c == t[1]) found.outer = std::min(found.outer, side->triangle);
    }
    return found;
  }

 private:
  struct Side {
    Index b, c;  // the corners after the lowest
    Index triangle;
  };

  // The same for all three rotations of a triangle, but not for its other side.
  static Triangle rotated(Triangle t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  }

  Csr<Side> by_lowest_;
};

// Spreads inside and outside from the triangles of the boundary over the tetrahedra.
class Carver {
 public:
  explicit Carver(const std::vector<Tetrahedron>& tets)
      : tets_(tets), adjacent_(tet_adjacency(tets)), side_(tets.size(), unknown),
        wall_(tets.size(), {false, false, false, false}) {}

  // Marks the tetrahedra at the boundary. Returns the triangles that are not facets.
  std::vector<Index> mark_at_boundary(const std::vector<Triangle>& boundary) {
    const Sides sides(boundary);
    std::vector<char> found(boundary.size(), 0);
    for (Index t = 0; t < tets_.size(); ++t)
      for (int k = 0; k < 4; ++k) {
        const auto [in, out] = sides.find(facet_of(tets_[t], k));
        if (in == kNone && out == kNone) continue;
        wall_[t][static_cast<std::size_t>(k)] = true;
        if (in != kNone) found[in] = 1;
        mark(t, in != kNone ? inside : outside);
      }
    std::vector<Index> missing;
    for (Index i = 0; i < boundary.size(); ++i)
      if (!found[i]) missing.push_back(i);
    return missing;
  }

  // Marks what is joined to marked tetrahedra by facets that are not on the boundary.
  void spread() {
    for (std::size_t head = 0; head < queue_.size(); ++head) {
      const Index t = queue_[head];
      for (std::size_t k = 0; k < 4; ++k) {
        if (wall_[t][k]) continue;
        if (adjacent_[t][k] != kNone) mark(adjacent_[t][k], side_[t]);
        else if (side_[t] == inside) throw Error("the tetrahedra do not fill the surface; please report this as a bug");
      }
    }
  }

  std::vector<Tetrahedron> tets_inside() const {
    std::vector<Tetrahedron> chosen;
    for (Index t = 0; t < tets_.size(); ++t)
      if (side_[t] == inside) chosen.push_back(tets_[t]);
    return chosen;
  }

 private:
  enum Side : char { unknown, inside, outside };

  void mark(Index tet, Side side) {
    if (side_[tet] == side) return;
    if (side_[tet] != unknown)
      throw Error("the surface does not separate inside from outside; it must be closed and oriented");
    side_[tet] = side;
    queue_.push_back(tet);
  }

  const std::vector<Tetrahedron>& tets_;
  std::vector<std::array<Index, 4>> adjacent_;
  std::vector<Side> side_;
  std::vector<std::array<bool, 4>> wall_;  // facets on the boundary
  std::vector<Index> queue_;               // marked tetrahedra, in the order of their marks
};

}  // namespace

Carved carve(const std::vector<Tetrahedron>& tets, const std::vector<Triangle>& boundary) {
  Carver carver(tets);
  Carved carved;
  carved.missing = carver.mark_at_boundary(boundary);
  if (!carved.missing.empty()) return carved;
  carver.spread();
  carved.tets = carver.tets_inside();
  return carved;
}

}  // namespace bisector
