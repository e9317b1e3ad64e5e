#include "voronoi/polyhedra.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bisector/error.h"
#include "core/append_range.h"
#include "core/parallel.h"

namespace bisector {
namespace {

constexpr std::size_t kMostPlanes = 0xffff;

}  // namespace

void append_polyhedron(const std::vector<Index>& labels, const std::vector<PolyhedronVertex>& vertices,
                       const SortedSeeds& seeds, Index tet, Index slot, ClippedPolyhedra& out) {
  out.pairs.push_back({tet, seeds.id[slot]});
  if (labels.size() > kMostPlanes)
    throw Error("the cell of seed " + std::to_string(seeds.id[slot]) +
                " has more than 65,535 facets in one tetrahedron; spread the seeds");
  for (const Index label : labels) out.labels.push_back(is_facet(label) ? label : seeds.id[label]);
  out.label_offsets.push_back(out.labels.size());
  using Triple = std::array<std::uint16_t, 3>;
  const auto triple = [](const std::array<Index, 3>& on) {
    const auto a = static_cast<std::uint16_t>(on[0]), b = static_cast<std::uint16_t>(on[1]),
               c = static_cast<std::uint16_t>(on[2]);
    if (a < b && a < c) return Triple{a, b, c};
    return b < c ? Triple{b, c, a} : Triple{c, a, b};
  };
  std::vector<std::pair<Triple, Index>> order;
  for (Index v = 0; v < vertices.size(); ++v) order.emplace_back(triple(vertices[v].on), v);
  std::sort(order.begin(), order.end());
  for (const auto& [on, v] : order) {
    out.triples.push_back(on);
    out.vertices.push_back(seeds.x[slot] + vertices[v].at);
  }
  out.vertex_offsets.push_back(out.triples.size());
}

void append_polyhedron(TetClipper& clipper, const SortedSeeds& seeds, Index tet, Index slot, ClippedPolyhedra& out) {
  std::vector<PolyhedronVertex> vertices;
  for (Index v = 0; v < clipper.vertex_count(); ++v) vertices.push_back({clipper.triple(v), clipper.vertex(v)});
  append_polyhedron(clipper.labels(), vertices, seeds, tet, slot, out);
}

void gather_polyhedra(const std::vector<const ClippedPolyhedra*>& parts,
                      const std::function<bool(const ClippedPolyhedra::Pair&)>& keep, ClippedPolyhedra& polyhedra) {
  struct Item {
    Index tet, cell;
    const ClippedPolyhedra* from;
    std::size_t place;
  };
  std::vector<Item> items;
  std::size_t labels = 0, vertices = 0;
  for (const ClippedPolyhedra* from : parts) {
    for (std::size_t k = 0; k < from->pairs.size(); ++k)
      if (keep(from->pairs[k])) items.push_back({from->pairs[k].tet, from->pairs[k].cell, from, k});
    labels += from->labels.size();
    vertices += from->triples.size();
  }
  sort_in_parallel(items,
                   [](const Item& a, const Item& b) { return a.tet != b.tet ? a.tet < b.tet : a.cell < b.cell; });
  polyhedra = {};
  polyhedra.pairs.reserve(items.size());
  polyhedra.label_offsets.reserve(items.size() + 1);
  polyhedra.vertex_offsets.reserve(items.size() + 1);
  polyhedra.labels.reserve(labels);
  polyhedra.triples.reserve(vertices);
  polyhedra.vertices.reserve(vertices);
  for (const Item& item : items) {
    const ClippedPolyhedra& from = *item.from;
    const std::size_t k = item.place;
    polyhedra.pairs.push_back(from.pairs[k]);
    append_range(polyhedra.labels, from.labels, from.label_offsets[k], from.label_offsets[k + 1]);
    append_range(polyhedra.triples, from.triples, from.vertex_offsets[k], from.vertex_offsets[k + 1]);
    append_range(polyhedra.vertices, from.vertices, from.vertex_offsets[k], from.vertex_offsets[k + 1]);
    polyhedra.label_offsets.push_back(polyhedra.labels.size());
    polyhedra.vertex_offsets.push_back(polyhedra.triples.size());
  }
}

}  // namespace bisector
