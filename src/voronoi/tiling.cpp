#include "voronoi/tiling.h"

#include <algorithm>
#include <atomic>

#include "core/parallel.h"
#include "voronoi/polygons.h"

namespace bisector {
namespace {

// One edge of a polygon with the labels of the edges before and after it: its ends.
struct Side {
  Index cell, label, before, after;
};

bool tiles(const std::vector<Side>& sides) {
  std::vector<Side> sorted = sides;
  const auto less = [](const Side& a, const Side& b) { return a.cell != b.cell ? a.cell < b.cell : a.label < b.label; };
  std::sort(sorted.begin(), sorted.end(), less);
  const auto find = [&](Index cell, Index label) -> const Side* {
    const auto range = std::equal_range(sorted.begin(), sorted.end(), Side{cell, label, 0, 0}, less);
    return range.second - range.first == 1 ? &*range.first : nullptr;
  };
  std::size_t on_edges = 0;
  for (const Side& s : sorted) {
    if (is_edge(s.label)) {
      ++on_edges;
      continue;
    }
    const Side* other = find(s.label, s.cell);
    if (!other || other->before != s.after || other->after != s.before) return false;
  }
  // Along each facet edge from corner to corner: every side continues in the cell that its last vertex names.
  std::size_t covered = 0;
  for (Index k = 0; k < 3; ++k) {
    const Index edge = kEdgeLabel | k, previous = kEdgeLabel | (k + 2) % 3, next = kEdgeLabel | (k + 1) % 3;
    const Side* side = nullptr;
    for (const Side& s : sorted)
      if (s.label == edge && s.before == previous) side = &s;
    for (std::size_t guard = 0; side && guard < sorted.size(); ++guard) {
      ++covered;
      if (is_edge(side->after)) {
        if (side->after != next) return false;
        break;
      }
      const Side* following = find(side->after, edge);
      if (!following || following->before != side->cell) return false;
      side = following;
    }
    if (!side) return false;
  }
  return covered == on_edges;
}

}  // namespace

std::size_t count_untiled(const Surface& surface, const RestrictedPolygons& polygons) {
  const std::size_t n = surface.mesh.triangles.size();
  const std::vector<std::size_t> begin = first_polygons(polygons, n);
  std::atomic<std::size_t> failed{0};
  parallel_chunks(n, 512, [&](std::size_t, std::size_t from, std::size_t to) {
    std::vector<Side> sides;
    for (std::size_t t = from; t < to; ++t) {
      if (surface.facet_of[t] == kNone) continue;  // a triangle without area has no polygons
      sides.clear();
      for (std::size_t k = begin[t]; k < begin[t + 1]; ++k) {
        const std::size_t first = polygons.offsets[k], size = polygons.offsets[k + 1] - first;
        for (std::size_t e = 0; e < size; ++e)
          sides.push_back({polygons.pairs[k].cell, polygons.labels[first + e],
                           polygons.labels[first + (e + size - 1) % size], polygons.labels[first + (e + 1) % size]});
      }
      if (!tiles(sides)) failed.fetch_add(1, std::memory_order_relaxed);
    }
  });
  return failed.load();
}

}  // namespace bisector
