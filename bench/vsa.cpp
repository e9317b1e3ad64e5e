#include "vsa.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_approximation/L21_metric_plane_proxy.h>
#include <CGAL/Surface_mesh_approximation/L2_metric_plane_proxy.h>
#include <CGAL/Variational_shape_approximation.h>

namespace bisector::bench {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Points = boost::property_map<Mesh, boost::vertex_point_t>::type;

template <class Metric>
std::vector<Index> regions(Mesh& mesh, const Metric& metric, std::size_t proxies, std::size_t iterations) {
  namespace np = CGAL::parameters;
  CGAL::Variational_shape_approximation<Mesh, Points, Metric> approximation(mesh, get(CGAL::vertex_point, mesh),
                                                                            metric);
  approximation.initialize_seeds(
      np::seeding_method(CGAL::Surface_mesh_approximation::HIERARCHICAL).max_number_of_proxies(proxies));
  approximation.run(iterations);
  const auto map = mesh.add_property_map<Mesh::Face_index, std::size_t>("f:region", 0).first;
  approximation.proxy_map(map);
  std::vector<Index> labels;
  for (const Mesh::Face_index f : mesh.faces()) labels.push_back(static_cast<Index>(map[f]));
  return labels;
}

}  // namespace

std::vector<Index> cgal_regions(const TriangleMesh& input, std::size_t proxies, std::size_t iterations, bool l21) {
  Mesh mesh;
  std::vector<Mesh::Vertex_index> vertices;
  for (const Vec3& p : input.vertices) vertices.push_back(mesh.add_vertex({p.x, p.y, p.z}));
  for (const auto& [a, b, c] : input.triangles) mesh.add_face(vertices[a], vertices[b], vertices[c]);
  const Points points = get(CGAL::vertex_point, mesh);
  if (l21) {
    const CGAL::Surface_mesh_approximation::L21_metric_plane_proxy<Mesh> metric(mesh, points);
    return regions(mesh, metric, proxies, iterations);
  }
  const CGAL::Surface_mesh_approximation::L2_metric_plane_proxy<Mesh> metric(mesh, points);
  return regions(mesh, metric, proxies, iterations);
}

}  // namespace bisector::bench
