#include "voronoi/polyhedra.h"

#include <algorithm>
#include <string>

#include "bisector/error.h"

namespace bisector {
namespace {

constexpr std::size_t kMostPlanes = 0xffff;

}  // namespace

void append_polyhedron(TetClipper& clipper, const SortedSeeds& seeds, Index tet, Index slot, ClippedPolyhedra& out) {
  out.pairs.push_back({tet, seeds.id[slot]});
  const std::vector<Index>& labels = clipper.labels();
  if (labels.size() > kMostPlanes)
    throw Error("the cell of seed " + std::to_string(seeds.id[slot]) +
                " has more than 65,535 facets in one tetrahedron; spread the seeds");
  for (const Index label : labels) out.labels.push_back(is_facet(label) ? label : seeds.id[label]);
  out.label_offsets.push_back(out.labels.size());
  struct Vertex {
    std::array<std::uint16_t, 3> triple;
    Index index;
  };
  std::vector<Vertex> vertices;
  for (Index v = 0; v < clipper.vertex_count(); ++v) {
    const std::array<Index, 3> on = clipper.triple(v);
    vertices.push_back(
        {{static_cast<std::uint16_t>(on[0]), static_cast<std::uint16_t>(on[1]), static_cast<std::uint16_t>(on[2])}, v});
  }
  std::sort(vertices.begin(), vertices.end(), [](const Vertex& a, const Vertex& b) { return a.triple < b.triple; });
  for (const Vertex& v : vertices) {
    out.triples.push_back(v.triple);
    out.vertices.push_back(seeds.x[slot] + clipper.vertex(v.index));
  }
  out.vertex_offsets.push_back(out.triples.size());
}

}  // namespace bisector
