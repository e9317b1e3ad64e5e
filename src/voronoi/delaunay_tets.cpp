#include "voronoi/delaunay_tets.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <algorithm>
#include <utility>

namespace bisector {

std::vector<Tetrahedron> delaunay_tets(const std::vector<Vec3>& points) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<Index, Kernel>;
  using CellBase = CGAL::Delaunay_triangulation_cell_base_3<Kernel>;
  using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;
  std::vector<std::pair<Kernel::Point_3, Index>> input;
  input.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    input.emplace_back(Kernel::Point_3(points[i].x, points[i].y, points[i].z), static_cast<Index>(i));
  const Delaunay dt(input.begin(), input.end());
  std::vector<Tetrahedron> tets;
  if (dt.dimension() < 3) return tets;
  tets.reserve(dt.number_of_finite_cells());
  for (const auto cell : dt.finite_cell_handles()) {
    Tetrahedron t;
    for (int k = 0; k < 4; ++k) t[static_cast<std::size_t>(k)] = cell->vertex(k)->info();
    // An even permutation: the lowest first, then the lowest of the others.
    const auto low = static_cast<std::size_t>(std::min_element(t.begin(), t.end()) - t.begin());
    if (low > 0) {
      std::swap(t[0], t[low]);
      std::swap(t[1], t[2]);
    }
    std::rotate(t.begin() + 1, std::min_element(t.begin() + 1, t.end()), t.end());
    tets.push_back(t);
  }
  std::sort(tets.begin(), tets.end());
  return tets;
}

}  // namespace bisector
