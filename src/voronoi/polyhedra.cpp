#include "voronoi/polyhedra.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bisector/error.h"

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

}  // namespace bisector
