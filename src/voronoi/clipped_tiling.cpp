// The certificate of a reported clipped diagram.
#include <algorithm>
#include <atomic>
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
    for (std::size_t k = 0; k < first_whole_; ++k)
      for (std::size_t l = p_.label_offsets[k]; l < p_.label_offsets[k + 1]; ++l)
        if (!is_facet(p_.labels[l])) cut_bisectors_.emplace_back(p_.pairs[k].cell, p_.labels[l]);
    sort_in_parallel(cut_bisectors_, std::less<>());
    cut_bisectors_.erase(std::unique(cut_bisectors_.begin(), cut_bisectors_.end()), cut_bisectors_.end());
  }

  bool tet_tiled(Index tet) const {
    std::vector<FacetOf> facets = facets_of(first_[tet], first_[tet + 1]);
    // A tetrahedron that cells taken whole fill has no polyhedra of its own.
    if (facets.empty()) return wholes() > 0;
    bool complete = true;
    std::vector<std::pair<Index, Index>> corner_facets;
    for (const FacetOf& f : facets) {
      if (is_facet(f.label)) {
        for (const auto& corner : f.corners)
          if (is_facet(corner.first) && is_facet(corner.second))
            corner_facets.emplace_back(f.label, opposite(f.label, corner));
        continue;
      }
      const FacetOf* other = find(facets, f.label, f.cell);
      if (other ? other->corners != f.corners : !whole_has(f.label, f.cell)) return false;
      complete = complete && other;
    }
    // Each corner once, seen from its three facets, unless a cell taken whole holds it.
    std::sort(corner_facets.begin(), corner_facets.end());
    if (complete ? corner_facets.size() != 12 : corner_facets.size() % 3 != 0) return false;
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

  bool whole_tiled(std::size_t k) const {
    const Index cell = p_.pairs[first_whole_ + k].cell;
    if (met_cell(cell)) return false;
    for (const FacetOf& f : facets_of(first_whole_ + k, first_whole_ + k + 1)) {
      if (is_facet(f.label)) return false;
      if (const std::size_t other = whole_of(f.label); other != kMissing) {
        const std::vector<FacetOf> there = facets_of(other, other + 1);
        const FacetOf* back = find(there, f.label, cell);
        if (!back || back->corners != f.corners) return false;
      } else if (!std::binary_search(cut_bisectors_.begin(), cut_bisectors_.end(), std::pair{f.label, cell})) {
        return false;
      }
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

  std::size_t whole_of(Index cell) const {
    const auto begin = p_.pairs.begin() + static_cast<std::ptrdiff_t>(first_whole_);
    const auto at = std::lower_bound(begin, p_.pairs.end(), cell,
                                     [](const ClippedPolyhedra::Pair& pair, Index c) { return pair.cell < c; });
    return at != p_.pairs.end() && at->cell == cell ? static_cast<std::size_t>(at - p_.pairs.begin()) : kMissing;
  }

  // Whether `cell` was taken whole and has the label.
  bool whole_has(Index cell, Index label) const {
    const std::size_t k = whole_of(cell);
    if (k == kMissing) return false;
    return std::binary_search(p_.labels.data() + p_.label_offsets[k], p_.labels.data() + p_.label_offsets[k + 1],
                              label);
  }

  bool met_cell(Index cell) const {
    const auto at = std::lower_bound(cut_bisectors_.begin(), cut_bisectors_.end(), std::pair{cell, Index{0}});
    return at != cut_bisectors_.end() && at->first == cell;
  }

  const Solid& solid_;
  const ClippedPolyhedra& p_;
  std::vector<std::size_t> first_;  // polyhedron of each tetrahedron
  std::size_t first_whole_ = 0;
  std::vector<std::pair<Index, Index>> cut_bisectors_;  // cell and label wherever cells are cut up, sorted
};

}  // namespace

std::size_t count_untiled(const Solid& solid, const ClippedPolyhedra& polyhedra) {
  const Tiling tiling(solid, polyhedra);
  std::atomic<std::size_t> failed{0};
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
