#include "job/cells.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <stdexcept>

#include "core/random.h"

namespace bisector::job {
namespace {

using Colour = std::array<unsigned char, 3>;

// Light enough for shading to show, and told apart side by side.
constexpr std::array<Colour, 12> kPalette{{{232, 160, 140},
                                           {140, 190, 224},
                                           {244, 211, 128},
                                           {158, 206, 158},
                                           {196, 170, 220},
                                           {240, 186, 206},
                                           {120, 196, 190},
                                           {214, 190, 160},
                                           {186, 204, 112},
                                           {150, 160, 214},
                                           {246, 180, 112},
                                           {208, 216, 224}}};

std::vector<std::array<Index, 2>> adjacent_cells(const RestrictedPolygons& polygons) {
  std::vector<std::array<Index, 2>> edges;  // the higher cell first
  for (std::size_t k = 0; k < polygons.pairs.size(); ++k)
    for (std::size_t e = polygons.offsets[k]; e < polygons.offsets[k + 1]; ++e)
      if (const Index other = polygons.labels[e]; !is_edge(other) && other < polygons.pairs[k].cell)
        edges.push_back({polygons.pairs[k].cell, other});
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace

// Greedy in ascending order: a random colour of those that no neighbour has yet.
std::vector<Colour> contrasting_colours(const std::vector<std::array<Index, 2>>& neighbours, std::size_t count) {
  std::vector<unsigned char> chosen(count);
  std::vector<Colour> colours(count);
  std::size_t k = 0;
  for (Index i = 0; i < count; ++i) {
    unsigned free = (1u << kPalette.size()) - 1;
    for (; k < neighbours.size() && neighbours[k][0] == i; ++k) free &= ~(1u << chosen[neighbours[k][1]]);
    if (free == 0) free = (1u << kPalette.size()) - 1;
    auto skip = Random(0, i).bits() % static_cast<unsigned>(std::popcount(free));
    for (; skip > 0; --skip) free &= free - 1;
    chosen[i] = static_cast<unsigned char>(std::countr_zero(free));
    colours[i] = kPalette[chosen[i]];
  }
  return colours;
}

PolygonMesh coloured_cells(const RestrictedPolygons& polygons, std::size_t seeds) {
  PolygonMesh mesh;
  mesh.vertices = polygons.vertices;
  mesh.polygons.offsets = polygons.offsets;
  mesh.polygons.values.resize(polygons.vertices.size());
  std::iota(mesh.polygons.values.begin(), mesh.polygons.values.end(), Index{0});
  const std::vector<Colour> colours = contrasting_colours(adjacent_cells(polygons), seeds);
  for (const RestrictedPolygons::Pair& pair : polygons.pairs) {
    mesh.labels.push_back(pair.cell);
    mesh.colours.push_back(colours[pair.cell]);
  }
  return mesh;
}

// At a vertex three planes meet, counter-clockwise seen from outside. Around the face of the first one the next corner
// is where the third comes second.
PolyhedronMesh polyhedra_of(const ClippedPolyhedra& polyhedra) {
  PolyhedronMesh mesh;
  for (std::size_t k = 0; k < polyhedra.pairs.size(); ++k) {
    const std::size_t labels = polyhedra.label_offsets[k + 1] - polyhedra.label_offsets[k];
    const std::size_t first = polyhedra.vertex_offsets[k], end = polyhedra.vertex_offsets[k + 1];
    const auto base = static_cast<Index>(mesh.vertices.size());
    // Of each plane the corners of its face: the plane before, that after, the vertex.
    std::vector<std::vector<std::array<Index, 3>>> corners(labels);
    for (std::size_t v = first; v < end; ++v) {
      const std::array<std::uint16_t, 3>& planes = polyhedra.triples[v];
      for (std::size_t i = 0; i < 3; ++i)
        corners[planes[i]].push_back({planes[(i + 1) % 3], planes[(i + 2) % 3], base + static_cast<Index>(v - first)});
      mesh.vertices.push_back(polyhedra.vertices[v]);
    }
    for (const std::vector<std::array<Index, 3>>& face : corners) {
      if (face.empty()) continue;
      std::size_t at = 0;
      for (std::size_t n = 0; n < face.size(); ++n) {
        mesh.faces.values.push_back(face[at][2]);
        const auto next = std::find_if(face.begin(), face.end(), [&](const auto& c) { return c[0] == face[at][1]; });
        at = static_cast<std::size_t>(next - face.begin());
        if (next == face.end()) throw std::logic_error("the planes of a polyhedron's face form no ring");
      }
      mesh.polyhedra.values.push_back(static_cast<Index>(mesh.faces.rows()));
      mesh.faces.offsets.push_back(mesh.faces.values.size());
    }
    mesh.polyhedra.offsets.push_back(mesh.polyhedra.values.size());
    mesh.cells.push_back(polyhedra.pairs[k].cell);
    mesh.tets.push_back(polyhedra.pairs[k].tet);
  }
  return mesh;
}

}  // namespace bisector::job
