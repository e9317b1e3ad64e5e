// The certificate of a reported clipped diagram.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <utility>

#include "core/parallel.h"
#include "voronoi/clipped.h"

namespace bisector {
namespace {

// The corners of one facet of a polyhedron, each by its other two planes, sorted.
using Corners = std::vector<std::pair<Index, Index>>;

struct FacetOf {
  Index cell, label;
  Corners corners;

  friend bool operator<(const FacetOf& a, const FacetOf& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.label < b.label;
  }
};

class Tiling {
 public:
  Tiling(const Solid& solid, const ClippedPolyhedra& polyhedra) : solid_(solid), p_(polyhedra) {
    first_.assign(solid.mesh.tets.size() + 1, 0);
    while (first_whole_ < p_.pairs.size() && p_.pairs[first_whole_].tet != kNone)
      ++first_[p_.pairs[first_whole_++].tet + 1];
    for (std::size_t t = 0; t + 1 < first_.size(); ++t) first_[t + 1] += first_[t];
    for (std::size_t k = first_whole_; k < p_.pairs.size(); ++k) {
      const Index cell = p_.pairs[k].cell;
      if (whole_of_.size() <= cell) whole_of_.resize(cell + 1, kMissing);
      whole_of_[cell] = k;
    }
  }

  bool tet_tiled(Index tet) const {
    std::vector<FacetOf> facets = facets_of(first_[tet], first_[tet + 1]);
    std::vector<std::pair<Index, Index>> corner_facets;
    for (const FacetOf& f : facets) {
      if (is_facet(f.label)) {
        for (const auto& corner : f.corners)
          if (is_facet(corner.first) && is_facet(corner.second))
            corner_facets.emplace_back(f.label, opposite(f.label, corner));
        continue;
      }
      const FacetOf* other = find(facets, f.label, f.cell);
      if (!other || other->corners != f.corners) return false;
    }
    // Each corner once, seen from its three facets.
    std::sort(corner_facets.begin(), corner_facets.end());
    if (corner_facets.size() != 12) return false;
    if (std::adjacent_find(corner_facets.begin(), corner_facets.end()) != corner_facets.end()) return false;
    for (Index k = 0; k < 4; ++k) {
      const Index across = solid_.adjacent[tet][k];
      if (across == kNone || across < tet) continue;
      const auto& back = solid_.adjacent[across];
      const std::vector<FacetOf> there = facets_of(first_[across], first_[across + 1]);
      bool met = false;
      for (Index l = 0; l < 4; ++l)
        if (back[l] == tet && on_facet(tet, k, facets) == on_facet(across, l, there)) met = true;
      if (!met) return false;
    }
    return true;
  }

  std::size_t wholes() const { return p_.pairs.size() - first_whole_; }
  bool has_cut_cells() const { return first_whole_ > 0 || p_.pairs.empty(); }

  // Whether the cells across the bisectors of a whole cell have it for a neighbour, and all four cells at each of its
  // vertices have that vertex, in the sense that it has there.
  bool whole_tiled(std::size_t k) const {
    const Index cell = p_.pairs[first_whole_ + k].cell;
    const std::span<const Index> labels = labels_of(first_whole_ + k);
    for (const Index label : labels)
      if (is_facet(label) || !whole_has(label, cell)) return false;
    for (std::size_t v = p_.vertex_offsets[first_whole_ + k]; v < p_.vertex_offsets[first_whole_ + k + 1]; ++v) {
      const Index a = labels[p_.triples[v][0]], b = labels[p_.triples[v][1]], c = labels[p_.triples[v][2]];
      if (!has_vertex(a, {cell, c, b}) || !has_vertex(b, {cell, a, c}) || !has_vertex(c, {cell, b, a})) return false;
    }
    return true;
  }

 private:
  static constexpr std::size_t kMissing = static_cast<std::size_t>(-1);

  std::vector<FacetOf> facets_of(std::size_t begin, std::size_t end) const {
    std::vector<FacetOf> facets;
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t base = facets.size();
      const Index* labels = p_.labels.data() + p_.label_offsets[k];
      for (std::size_t l = 0; l < p_.label_offsets[k + 1] - p_.label_offsets[k]; ++l)
        facets.push_back({p_.pairs[k].cell, labels[l], {}});
      for (std::size_t v = p_.vertex_offsets[k]; v < p_.vertex_offsets[k + 1]; ++v) {
        const auto& on = p_.triples[v];
        for (std::size_t e = 0; e < 3; ++e) {
          const Index a = labels[on[(e + 1) % 3]], b = labels[on[(e + 2) % 3]];
          facets[base + on[e]].corners.emplace_back(std::min(a, b), std::max(a, b));
        }
      }
    }
    for (FacetOf& f : facets) std::sort(f.corners.begin(), f.corners.end());
    std::sort(facets.begin(), facets.end());
    return facets;
  }

  static const FacetOf* find(const std::vector<FacetOf>& facets, Index cell, Index label) {
    const auto range = std::equal_range(facets.begin(), facets.end(), FacetOf{cell, label, {}});
    return range.second - range.first == 1 ? &*range.first : nullptr;
  }

  // The facet that does not meet in the corner of three.
  static Index opposite(Index label, const std::pair<Index, Index>& others) {
    return 6 - (label & ~kFacetLabel) - (others.first & ~kFacetLabel) - (others.second & ~kFacetLabel);
  }

  // What tiles facet k of the tetrahedron, with its edges named by the vertices opposite them, as the other side names
  // them.
  std::vector<std::pair<Index, Corners>> on_facet(Index tet, Index k, const std::vector<FacetOf>& facets) const {
    const auto common = [&](Index label) {
      return is_facet(label) ? kFacetLabel | solid_.mesh.tets[tet][label & ~kFacetLabel] : label;
    };
    std::vector<std::pair<Index, Corners>> tiles;
    for (const FacetOf& f : facets) {
      if (f.label != (kFacetLabel | k)) continue;
      Corners corners;
      for (const auto& [a, b] : f.corners) corners.emplace_back(std::minmax(common(a), common(b)));
      std::sort(corners.begin(), corners.end());
      tiles.emplace_back(f.cell, std::move(corners));
    }
    return tiles;
  }

  std::span<const Index> labels_of(std::size_t k) const {
    return {p_.labels.data() + p_.label_offsets[k], p_.labels.data() + p_.label_offsets[k + 1]};
  }

  std::size_t whole_of(Index cell) const { return cell < whole_of_.size() ? whole_of_[cell] : kMissing; }

  bool whole_has(Index cell, Index label) const {
    const std::size_t k = whole_of(cell);
    if (k == kMissing) return false;
    const std::span<const Index> labels = labels_of(k);
    return std::binary_search(labels.begin(), labels.end(), label);
  }

  // Whether a whole cell has the vertex where these three meet it, counter-clockwise seen from outside.
  bool has_vertex(Index cell, std::array<Index, 3> others) const {
    const std::size_t k = whole_of(cell);
    if (k == kMissing) return false;
    std::rotate(others.begin(), std::min_element(others.begin(), others.end()), others.end());
    const std::span<const Index> labels = labels_of(k);
    std::array<std::uint16_t, 3> triple{};
    for (std::size_t e = 0; e < 3; ++e) {
      const auto at = std::lower_bound(labels.begin(), labels.end(), others[e]);
      if (at == labels.end() || *at != others[e]) return false;
      triple[e] = static_cast<std::uint16_t>(at - labels.begin());
    }
    const auto first = p_.triples.begin();
    return std::binary_search(first + static_cast<std::ptrdiff_t>(p_.vertex_offsets[k]),
                              first + static_cast<std::ptrdiff_t>(p_.vertex_offsets[k + 1]), triple);
  }

  const Solid& solid_;
  const ClippedPolyhedra& p_;
  std::vector<std::size_t> first_;  // polyhedron of each tetrahedron
  std::size_t first_whole_ = 0;
  std::vector<std::size_t> whole_of_;  // polyhedron of each cell that is whole
};

}  // namespace

std::size_t count_untiled(const Solid& solid, const ClippedPolyhedra& polyhedra) {
  const Tiling tiling(solid, polyhedra);
  std::atomic<std::size_t> failed{0};
  if (tiling.has_cut_cells())
    parallel_each(
        solid.mesh.tets.size(),
        [&](std::size_t t) {
          if (solid.six_volumes[t] > 0 && !tiling.tet_tiled(static_cast<Index>(t)))
            failed.fetch_add(1, std::memory_order_relaxed);
        },
        64);
  parallel_each(
      tiling.wholes(),
      [&](std::size_t k) {
        if (!tiling.whole_tiled(k)) failed.fetch_add(1, std::memory_order_relaxed);
      },
      64);
  return failed.load();
}

}  // namespace bisector
