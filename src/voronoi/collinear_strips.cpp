#include "voronoi/collinear_strips.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "voronoi/polygons.h"

namespace bisector {
namespace {

bool distinct(const Triangle& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; }

}  // namespace

CollinearStrips::CollinearStrips(const Surface& surface, const RestrictedPolygons& polygons)
    : surface_(surface), polygons_(polygons) {
  const std::vector<Triangle>& triangles = surface.mesh.triangles;
  for (Index t = 0; t < triangles.size(); ++t)
    if (surface.facet_of[t] == kNone && distinct(triangles[t])) flat_.push_back(t);
  if (flat_.empty()) return;
  read_facets();
  place_loose_vertices();
  read_flat();
}

RestrictedPolygons CollinearStrips::merged(std::vector<Index>& source) const {
  RestrictedPolygons all;
  std::size_t k = 0;
  const auto copy_below = [&](std::size_t triangle) {
    for (; k < polygons_.pairs.size() && polygons_.pairs[k].triangle < triangle; ++k) {
      all.pairs.push_back(polygons_.pairs[k]);
      all.labels.insert(all.labels.end(), polygons_.labels.begin() + static_cast<std::ptrdiff_t>(polygons_.offsets[k]),
                        polygons_.labels.begin() + static_cast<std::ptrdiff_t>(polygons_.offsets[k + 1]));
      all.offsets.push_back(all.labels.size());
      source.push_back(static_cast<Index>(k));
    }
  };
  for (const auto& [triangle, chain] : chains_) {
    copy_below(triangle);
    std::vector<std::size_t> order(chain.cells.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return chain.cells[a] < chain.cells[b]; });
    for (const std::size_t r : order) {
      append_strip(chain, r, all.labels);
      all.pairs.push_back({triangle, chain.cells[r]});
      all.offsets.push_back(all.labels.size());
      source.push_back(kNone);
    }
  }
  copy_below(kNone);
  return all;
}

// The cells along an edge from a to b, if known.
std::optional<CollinearStrips::Cells> CollinearStrips::along(Index a, Index b) const {
  const auto at = cells_.find(edge_of(a, b));
  if (at == cells_.end()) return std::nullopt;
  Cells cells = at->second;
  if (a > b) std::reverse(cells.begin(), cells.end());
  return cells;
}

bool CollinearStrips::know(Index a, Index b, Cells cells) {
  if (a > b) std::reverse(cells.begin(), cells.end());
  return cells_.try_emplace(edge_of(a, b), std::move(cells)).second;
}

// What facets say of the edges and vertices of collinear triangles.
void CollinearStrips::read_facets() {
  const std::vector<Triangle>& triangles = surface_.mesh.triangles;
  std::vector<char> wanted(surface_.mesh.vertices.size(), 0);
  for (Index t : flat_)
    for (Index v : triangles[t]) wanted[v] = 1;
  const std::vector<std::size_t> begin = first_polygons(polygons_, triangles.size());
  for (Index t = 0; t < triangles.size(); ++t) {
    if (surface_.facet_of[t] == kNone) continue;
    for (Index k = 0; k < 3; ++k) {
      const Index a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      if (!wanted[a] && !wanted[b]) continue;
      const Cells cells = walk(begin[t], begin[t + 1], k);
      if (cells.empty()) continue;
      owner_.try_emplace(a, cells.front());
      owner_.try_emplace(b, cells.back());
      if (wanted[a] && wanted[b]) know(a, b, cells);
    }
  }
}

// The cells along edge k of a facet whose polygons are given.
CollinearStrips::Cells CollinearStrips::walk(std::size_t begin, std::size_t end, Index k) const {
  const Index edge = kEdgeLabel | k;
  std::map<Index, std::array<Index, 2>> ends;  // of each cell: labels before and after the edge
  Index cell = kNone;
  for (std::size_t p = begin; p < end; ++p) {
    const std::size_t first = polygons_.offsets[p], size = polygons_.offsets[p + 1] - first;
    for (std::size_t e = 0; e < size; ++e) {
      if (polygons_.labels[first + e] != edge) continue;
      const Index before = polygons_.labels[first + (e + size - 1) % size];
      ends[polygons_.pairs[p].cell] = {before, polygons_.labels[first + (e + 1) % size]};
      if (is_edge(before)) cell = polygons_.pairs[p].cell;
    }
  }
  Cells cells;
  while (cells.size() < ends.size() && ends.count(cell)) {
    cells.push_back(cell);
    cell = ends[cell][1];
  }
  return cells;
}

// Vertices that no facet uses are taken to be where the vertex is from which they are reached first: that changes
// nothing but the division of triangles without area.
void CollinearStrips::place_loose_vertices() {
  for (const auto& [v, cell] : owner_) position_[v] = surface_.mesh.vertices[v];
  for (bool changed = true; changed;) {
    changed = false;
    for (Index t : flat_)
      for (Index v : surface_.mesh.triangles[t]) {
        if (owner_.count(v)) continue;
        for (Index from : surface_.mesh.triangles[t])
          if (!owner_.count(v) && owner_.count(from)) {
            owner_[v] = owner_[from];
            position_[v] = position_[from];
            changed = true;
          }
      }
  }
}

void CollinearStrips::read_flat() {
  for (bool changed = true; changed;) {
    changed = false;
    for (Index t : flat_)
      if (!chains_.count(t) && read(t)) changed = true;
  }
}

bool CollinearStrips::read(Index t) {
  const Triangle& v = surface_.mesh.triangles[t];
  for (Index corner : v)
    if (!owner_.count(corner)) return false;
  std::array<Index, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    const Vec3 &p = position_.at(v[a]), &q = position_.at(v[b]);
    return std::tie(p.x, p.y, p.z, v[a]) < std::tie(q.x, q.y, q.z, v[b]);
  });
  Chain chain{order[0], order[1], order[2], {}, 0};
  const Index a = v[chain.low], c = v[chain.middle], b = v[chain.high];
  // An edge between two vertices at one place lies in their cell.
  for (const auto& [p, q] : {std::pair{a, c}, std::pair{c, b}, std::pair{a, b}})
    if (position_.at(p) == position_.at(q)) know(p, q, {owner_.at(p)});
  std::optional<Cells> whole = along(a, b);
  const std::optional<Cells> first = along(a, c), second = along(c, b);
  if (!whole) {
    if (!first || !second) return false;
    whole = first;
    whole->insert(whole->end(), second->begin() + 1, second->end());
    know(a, b, *whole);
  }
  const auto at = std::find(whole->begin(), whole->end(), owner_.at(c));
  if (at == whole->end()) return false;
  know(a, c, Cells(whole->begin(), at + 1));
  know(c, b, Cells(at, whole->end()));
  chain.split = static_cast<std::size_t>(at - whole->begin());
  chain.cells = std::move(*whole);
  chains_.emplace(t, std::move(chain));
  return true;
}

void CollinearStrips::append_strip(const Chain& chain, std::size_t r, std::vector<Index>& labels) {
  const bool before = r <= chain.split, after = r >= chain.split;  // of the middle corner, on its side
  if (r > 0) labels.push_back(chain.cells[r - 1]);
  if ((chain.low + 1) % 3 == chain.middle) {
    if (before) labels.push_back(kEdgeLabel | chain.low);
    if (after) labels.push_back(kEdgeLabel | chain.middle);
  } else {
    labels.push_back(kEdgeLabel | chain.low);
  }
  if (r + 1 < chain.cells.size()) labels.push_back(chain.cells[r + 1]);
  if ((chain.low + 1) % 3 == chain.middle) {
    labels.push_back(kEdgeLabel | chain.high);
  } else {
    if (after) labels.push_back(kEdgeLabel | chain.high);
    if (before) labels.push_back(kEdgeLabel | chain.middle);
  }
}

}  // namespace bisector
