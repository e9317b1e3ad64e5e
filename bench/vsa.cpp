#include "vsa.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_approximation/L21_metric_plane_proxy.h>
#include <CGAL/Surface_mesh_approximation/L2_metric_plane_proxy.h>
#include <CGAL/Variational_shape_approximation.h>

#include <array>
#include <iterator>

namespace bisector::bench {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Points = boost::property_map<Mesh, boost::vertex_point_t>::type;
using L2 = CGAL::Surface_mesh_approximation::L2_metric_plane_proxy<Mesh>;
using L21 = CGAL::Surface_mesh_approximation::L21_metric_plane_proxy<Mesh>;

template <class Metric>
using Approximation = CGAL::Variational_shape_approximation<Mesh, Points, Metric>;

template <class Metric>
std::vector<Index> find_regions(Mesh& mesh, Approximation<Metric>& approximation, std::size_t proxies,
                                std::size_t iterations) {
  namespace np = CGAL::parameters;
  approximation.initialize_seeds(
      np::seeding_method(CGAL::Surface_mesh_approximation::HIERARCHICAL).max_number_of_proxies(proxies));
  approximation.run(iterations);
  const auto map = mesh.add_property_map<Mesh::Face_index, std::size_t>("f:region", 0).first;
  approximation.proxy_map(map);
  std::vector<Index> labels;
  for (const Mesh::Face_index f : mesh.faces()) labels.push_back(static_cast<Index>(map[f]));
  return labels;
}

Mesh converted(const TriangleMesh& input) {
  Mesh mesh;
  std::vector<Mesh::Vertex_index> vertices;
  for (const Vec3& p : input.vertices) vertices.push_back(mesh.add_vertex({p.x, p.y, p.z}));
  for (const auto& [a, b, c] : input.triangles) mesh.add_face(vertices[a], vertices[b], vertices[c]);
  return mesh;
}

template <class Metric>
std::vector<Index> regions_by(const TriangleMesh& input, std::size_t proxies, std::size_t iterations) {
  Mesh mesh = converted(input);
  const Points points = get(CGAL::vertex_point, mesh);
  const Metric metric(mesh, points);
  Approximation<Metric> approximation(mesh, points, metric);
  return find_regions(mesh, approximation, proxies, iterations);
}

}  // namespace

std::vector<Index> cgal_regions(const TriangleMesh& input, std::size_t proxies, std::size_t iterations, bool l21) {
  return l21 ? regions_by<L21>(input, proxies, iterations) : regions_by<L2>(input, proxies, iterations);
}

CgalPolygons cgal_polygons(const TriangleMesh& input, std::size_t proxies, std::size_t iterations, double chord) {
  namespace np = CGAL::parameters;
  Mesh mesh = converted(input);
  const Points points = get(CGAL::vertex_point, mesh);
  const L2 metric(mesh, points);
  Approximation<L2> approximation(mesh, points, metric);
  CgalPolygons result;
  result.labels = find_regions(mesh, approximation, proxies, iterations);
  if (chord > 0)
    approximation.extract_mesh(
        np::subdivision_ratio(Kernel::FT(chord)).relative_to_chord(true).with_dihedral_angle(true));
  else approximation.extract_mesh(np::all_default());
  std::vector<Kernel::Point_3> anchors;
  std::vector<std::array<std::size_t, 3>> triangles;
  approximation.output(np::anchors(std::back_inserter(anchors)).triangles(std::back_inserter(triangles)));
  for (const Kernel::Point_3& p : anchors) result.mesh.vertices.push_back({p.x(), p.y(), p.z()});
  for (const auto& [a, b, c] : triangles)
    result.mesh.triangles.push_back({static_cast<Index>(a), static_cast<Index>(b), static_cast<Index>(c)});
  std::vector<std::vector<std::size_t>> borders;
  approximation.indexed_boundary_polygons(std::back_inserter(borders));
  result.polygons = borders.size();
  return result;
}

}  // namespace bisector::bench
