#include "job/cells.h"

#include <algorithm>
#include <bit>
#include <numeric>

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

}  // namespace bisector::job
