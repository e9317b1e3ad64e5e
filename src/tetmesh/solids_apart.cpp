#include "tetmesh/solids_apart.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "core/degenerate.h"
#include "core/geometry.h"
#include "mesh/tet_topology.h"
#include "mesh/topology.h"
#include "tetmesh/tet_sizing.h"

namespace bisector {
namespace {

// More are refused when edge lengths are laid down.
constexpr double kMostVertices = 1e9;

// Of all solids together.
struct Extent {
  double volume = 0, area = 0;
};

Extent extent_of(const TetMesh& mesh) {
  Extent extent;
  for (const auto& [a, b, c, d] : mesh.tets)
    extent.volume +=
        std::abs(rounded_six_volume(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], mesh.vertices[d])) / 6;
  for (const auto& [a, b, c] : boundary_facets(mesh.tets))
    extent.area += triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
  return extent;
}

}  // namespace

SolidsApart::SolidsApart(const TetMesh& mesh, const TetOptions& options) {
  if (!options.seeds.empty() || !options.sizing.sizes.points.empty()) return;
  // With two facets of each tetrahedron a solid hangs together as by all of them.
  TriangleMesh facets;
  facets.vertices = mesh.vertices;
  for (const auto& [a, b, c, d] : mesh.tets) {
    facets.triangles.push_back({a, b, c});
    facets.triangles.push_back({b, c, d});
  }
  const auto [volume, area] = extent_of(mesh);
  auto vertices = static_cast<double>(options.vertices);
  double edge = options.edge_length;
  if (vertices > 0) edge = estimate_tet_edge(volume, area, vertices);
  else vertices = estimate_tet_vertices(volume, area, edge);
  if (!(vertices < kMostVertices)) return;
  apart_ = SetApart(facets, std::vector<double>(mesh.vertices.size(), edge), static_cast<std::size_t>(vertices));
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
