#include "tetmesh/solids_apart.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "mesh/tet_topology.h"
#include "mesh/topology.h"
#include "tetmesh/tet_sizing.h"

namespace bisector {
SolidsApart::SolidsApart(const TetMesh& mesh, const TetOptions& options) {
  if (!options.seeds.empty() || !options.sizing.sizes.points.empty()) return;
  // With two facets of each tetrahedron a solid hangs together as by all of them.
  TriangleMesh facets;
  facets.vertices = mesh.vertices;
  for (const auto& [a, b, c, d] : mesh.tets) {
    facets.triangles.push_back({a, b, c});
    facets.triangles.push_back({b, c, d});
  }
  const std::vector<Index> component = label_components(facets.triangles, facets.vertices.size());
  if (std::all_of(component.begin(), component.end(), [](Index c) { return c == 0 || c == kNone; })) return;
  const auto [edge, vertices] =
      uniform_size(mesh, {mesh.vertices, boundary_facets(mesh.tets)}, {options.vertices, options.edge_length});
  apart_ = SetApart(facets, std::vector<double>(mesh.vertices.size(), edge), vertices);
  if (apart_.empty()) return;
  before_ = mesh.vertices;
  apart_.move(facets);
  moved_ = mesh;
  moved_.vertices = std::move(facets.vertices);
}

void SolidsApart::move_back(TetResult& result) const {
  if (empty()) return;
  const auto key = [](const Vec3& p) { return std::tuple(p.x, p.y, p.z); };
  std::map<std::tuple<double, double, double>, Vec3> given;
  for (std::size_t v = 0; v < before_.size(); ++v) given.emplace(key(moved_.vertices[v]), before_[v]);
  for (Vec3& p : result.mesh.vertices) {
    const auto at = given.find(key(p));
    p = at == given.end() ? apart_.back(p) : at->second;
  }
  apart_.report_back(result.boundary);
}

}  // namespace bisector
