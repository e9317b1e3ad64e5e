#include "tetmesh/tet_levels.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "core/grouping.h"

namespace bisector {
namespace {

constexpr std::size_t kCoarsest = 100;  // sites of the coarsest level, at least
constexpr std::size_t kLevels = 3;      // at most
constexpr std::size_t kRatio = 8;       // sites of a level over those of the next coarser one

}  // namespace

std::vector<std::array<Index, 2>> dual_edges(const ClippedPolyhedra& polyhedra) {
  std::vector<std::array<Index, 2>> edges;
  for (std::size_t k = 0; k < polyhedra.pairs.size(); ++k) {
    const Index cell = polyhedra.pairs[k].cell;
    for (std::size_t e = polyhedra.label_offsets[k]; e < polyhedra.label_offsets[k + 1]; ++e) {
      const Index label = polyhedra.labels[e];
      if (!is_facet(label)) edges.push_back({std::min(cell, label), std::max(cell, label)});
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

std::vector<std::size_t> tet_level_counts(std::size_t count) {
  std::vector<std::size_t> counts{count};
  while (counts.size() < kLevels && counts.back() / kRatio >= kCoarsest) counts.push_back(counts.back() / kRatio);
  std::reverse(counts.begin(), counts.end());
  return counts;
}

std::vector<Vec3> far_corners(const Diagram& diagram, const std::vector<Vec3>& seeds, std::size_t count) {
  const ClippedPolyhedra& polyhedra = diagram.polyhedra;
  const RestrictedPolygons& polygons = diagram.polygons;
  const std::vector<Moments>& cells = diagram.moments.cells;
  std::vector<double> squared(seeds.size(), -1);
  std::vector<Vec3> corner(seeds.size());
  const auto visit = [&](Index cell, const Vec3& p) {
    const double d = norm2(p - seeds[cell]);
    if (d <= squared[cell]) return;
    squared[cell] = d;
    corner[cell] = p;
  };
  for (std::size_t k = 0; k < polyhedra.pairs.size(); ++k)
    for (std::size_t e = polyhedra.vertex_offsets[k]; e < polyhedra.vertex_offsets[k + 1]; ++e)
      visit(polyhedra.pairs[k].cell, polyhedra.vertices[e]);
  for (std::size_t k = 0; k < polygons.pairs.size(); ++k)
    for (std::size_t e = polygons.offsets[k]; e < polygons.offsets[k + 1]; ++e)
      visit(polygons.pairs[k].cell, polygons.vertices[e]);
  std::vector<Index> order(seeds.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return cells[a].second > cells[b].second; });
  const std::vector<std::array<Index, 2>> edges = dual_edges(polyhedra);
  const Csr<Index> around = group_into_rows<Index>(seeds.size(), [&](const auto& put) {
    for (const auto& [a, b] : edges) {
      put(a, b);
      put(b, a);
    }
  });
  std::vector<char> taken(seeds.size(), 0);
  std::set<std::array<double, 3>> distinct;
  std::vector<Vec3> points;
  for (bool spread : {true, false}) {
    std::vector<char> blocked(seeds.size(), 0);
    for (const Index i : order) {
      if (points.size() == count) return points;
      if (squared[i] <= 0 || taken[i] || blocked[i]) continue;
      taken[i] = 1;
      if (!distinct.insert({corner[i].x, corner[i].y, corner[i].z}).second) continue;  // shared by several cells
      points.push_back(corner[i]);
      if (spread)
        for (const Index* j = around.begin(i); j != around.end(i); ++j) blocked[*j] = 1;
    }
  }
  return points;
}

std::vector<Vec3> refine_sites(const Diagram& diagram, const std::vector<Vec3>& seeds, std::size_t count) {
  std::vector<Vec3> finer = seeds;
  std::vector<std::array<Index, 2>> edges = dual_edges(diagram.polyhedra);
  const std::size_t room = count > finer.size() ? count - finer.size() : 0;
  if (edges.size() > room) {
    std::stable_sort(edges.begin(), edges.end(), [&](const std::array<Index, 2>& e, const std::array<Index, 2>& f) {
      return norm2(seeds[e[0]] - seeds[e[1]]) > norm2(seeds[f[0]] - seeds[f[1]]);
    });
    edges.resize(room);
  }
  for (const auto& [a, b] : edges) finer.push_back(0.5 * (seeds[a] + seeds[b]));
  if (finer.size() < count) {
    const std::vector<Vec3> more = far_corners(diagram, seeds, count - finer.size());
    finer.insert(finer.end(), more.begin(), more.end());
  }
  return finer;
}

}  // namespace bisector
