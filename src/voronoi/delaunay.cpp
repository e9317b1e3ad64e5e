#include "voronoi/delaunay.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <algorithm>
#include <numeric>

namespace bisector {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<Index, Kernel>;
using CellBase =
    CGAL::Triangulation_cell_base_with_info_3<Index, Kernel, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;

constexpr std::size_t kLargestCluster = 256;

struct Clusters {
  std::vector<Index> root;                   // of each finite cell
  std::vector<std::vector<Index>> vertices;  // of the clusters of more than one cell, by root; else empty
};

Index find(std::vector<Index>& parent, Index i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// Finite cells joined wherever the vertex opposite a shared facet lies exactly on the circumsphere.
Clusters join_cospherical(const Delaunay& dt, const std::vector<Delaunay::Cell_handle>& cells) {
  Clusters clusters;
  clusters.root.resize(cells.size());
  std::iota(clusters.root.begin(), clusters.root.end(), Index{0});
  const auto side = dt.geom_traits().side_of_oriented_sphere_3_object();
  bool joined = false;
  for (const auto& cell : cells)
    for (int k = 0; k < 4; ++k) {
      const auto other = cell->neighbor(k);
      if (dt.is_infinite(other) || other->info() < cell->info()) continue;
      const auto opposite = other->vertex(other->index(cell));
      if (side(cell->vertex(0)->point(), cell->vertex(1)->point(), cell->vertex(2)->point(), cell->vertex(3)->point(),
               opposite->point()) == CGAL::ON_ORIENTED_BOUNDARY) {
        clusters.root[find(clusters.root, other->info())] = find(clusters.root, cell->info());
        joined = true;
      }
    }
  if (!joined) return clusters;
  for (Index c = 0; c < cells.size(); ++c) clusters.root[c] = find(clusters.root, c);
  std::vector<Index> size(cells.size(), 0);
  for (Index root : clusters.root) ++size[root];
  clusters.vertices.resize(cells.size());
  for (Index c = 0; c < cells.size(); ++c) {
    if (size[clusters.root[c]] < 2) continue;
    auto& list = clusters.vertices[clusters.root[c]];
    for (int k = 0; k < 4; ++k) list.push_back(cells[c]->vertex(k)->info());
  }
  for (auto& list : clusters.vertices) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return clusters;
}

}  // namespace

std::optional<Csr<Index>> delaunay_neighbours(const std::vector<Vec3>& seeds) {
  std::vector<std::pair<Kernel::Point_3, Index>> points;
  points.reserve(seeds.size());
  for (std::size_t i = 0; i < seeds.size(); ++i)
    points.emplace_back(Kernel::Point_3(seeds[i].x, seeds[i].y, seeds[i].z), static_cast<Index>(i));
  const Delaunay dt(points.begin(), points.end());
  if (dt.dimension() < 3) return std::nullopt;

  std::vector<Delaunay::Cell_handle> cells;
  cells.reserve(dt.number_of_finite_cells());
  for (const auto cell : dt.finite_cell_handles()) {
    cell->info() = static_cast<Index>(cells.size());
    cells.push_back(cell);
  }
  const Clusters clusters = join_cospherical(dt, cells);
  for (const auto& list : clusters.vertices)
    if (list.size() > kLargestCluster) return std::nullopt;

  std::vector<Delaunay::Vertex_handle> vertex_of(seeds.size());
  for (const auto v : dt.finite_vertex_handles()) vertex_of[v->info()] = v;
  Csr<Index> rings;
  rings.offsets.reserve(seeds.size() + 1);
  std::vector<Index> ring;
  std::vector<Delaunay::Cell_handle> around;
  for (Index i = 0; i < seeds.size(); ++i) {
    ring.clear();
    around.clear();
    dt.incident_cells(vertex_of[i], std::back_inserter(around));
    for (const auto& cell : around) {
      for (int k = 0; k < 4; ++k)
        if (!dt.is_infinite(cell->vertex(k))) ring.push_back(cell->vertex(k)->info());
      if (clusters.vertices.empty() || dt.is_infinite(cell)) continue;
      const auto& more = clusters.vertices[clusters.root[cell->info()]];
      ring.insert(ring.end(), more.begin(), more.end());
    }
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    for (Index j : ring)
      if (j != i) rings.values.push_back(j);
    rings.offsets.push_back(rings.values.size());
  }
  return rings;
}

}  // namespace bisector
