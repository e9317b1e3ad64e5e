#include "delaunay_time.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <stdexcept>
#include <utility>

#include "common.h"

namespace bisector::bench {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertex = CGAL::Triangulation_vertex_base_with_info_3<Index, Kernel>;
using Cell = CGAL::Delaunay_triangulation_cell_base_3<Kernel>;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<Vertex, Cell>>;

}  // namespace

double delaunay_seconds(const std::vector<Vec3>& seeds) {
  std::vector<std::pair<Kernel::Point_3, Index>> points;
  points.reserve(seeds.size());
  for (const Vec3& x : seeds) points.emplace_back(Kernel::Point_3(x.x, x.y, x.z), static_cast<Index>(points.size()));
  const Stopwatch watch;
  const Delaunay triangulation(points.begin(), points.end());
  const double seconds = watch.seconds();
  if (triangulation.number_of_vertices() > seeds.size()) throw std::logic_error("more vertices than points");
  return seconds;
}

}  // namespace bisector::bench
