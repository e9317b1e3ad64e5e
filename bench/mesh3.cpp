#include "mesh3.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polyhedral_mesh_domain_with_features_3.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/make_mesh_3.h>

#include <map>
#include <vector>

namespace bisector::bench {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Polyhedron = CGAL::Surface_mesh<Kernel::Point_3>;
using Domain = CGAL::Polyhedral_mesh_domain_with_features_3<Kernel, Polyhedron>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index, Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

TetMesh mesh_3(const TriangleMesh& surface, const FeatureGraph& features, double edge, const std::string& optimiser) {
  Polyhedron polyhedron;
  std::vector<Polyhedron::Vertex_index> vertices;
  for (const Vec3& p : surface.vertices) vertices.push_back(polyhedron.add_vertex({p.x, p.y, p.z}));
  for (const auto& [a, b, c] : surface.triangles) polyhedron.add_face(vertices[a], vertices[b], vertices[c]);
  Domain domain(polyhedron);
  std::vector<std::vector<Kernel::Point_3>> lines;
  for (const FeatureCurve& curve : features.curves) {
    std::vector<Kernel::Point_3> line;
    for (Index v : curve.vertices) line.push_back(polyhedron.point(vertices[v]));
    if (curve.closed) line.push_back(line.front());
    lines.push_back(std::move(line));
  }
  domain.add_features(lines.begin(), lines.end());
  // Circumradii of equilateral triangles and regular tetrahedra are 0.58 and 0.61 edges; meshes have edges of all
  // lengths below. The distance hardly binds, so that the boundary is as fine as the inside.
  const Criteria criteria(CGAL::parameters::edge_size = edge, CGAL::parameters::facet_angle = 25,
                          CGAL::parameters::facet_size = 0.7 * edge, CGAL::parameters::facet_distance = 0.2 * edge,
                          CGAL::parameters::cell_radius_edge_ratio = 2, CGAL::parameters::cell_size = 0.75 * edge);
  using namespace CGAL::parameters;
  const Complex mesh = optimiser == "odt"
                           ? CGAL::make_mesh_3<Complex>(domain, criteria, no_lloyd(), odt(), perturb(), exude())
                           : CGAL::make_mesh_3<Complex>(domain, criteria, lloyd(), no_odt(), perturb(), exude());
  TetMesh result;
  std::map<Triangulation::Vertex_handle, Index> index;
  for (auto cell = mesh.cells_in_complex_begin(); cell != mesh.cells_in_complex_end(); ++cell) {
    Tetrahedron tet{};
    for (int k = 0; k < 4; ++k) {
      const auto v = cell->vertex(k);
      const auto [at, fresh] = index.insert({v, static_cast<Index>(result.vertices.size())});
      if (fresh) result.vertices.push_back({v->point().x(), v->point().y(), v->point().z()});
      tet[static_cast<std::size_t>(k)] = at->second;
    }
    result.tets.push_back(tet);
  }
  return result;
}

}  // namespace bisector::bench
