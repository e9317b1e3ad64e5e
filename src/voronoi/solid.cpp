#include "voronoi/solid.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "bisector/error.h"
#include "core/parallel.h"
#include "mesh/tet_adjacency.h"
#include "voronoi/exact_tet.h"

namespace bisector {
namespace {

// Six times the volume, rounded from its exact value where the products cancel.
double six_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a, v = c - a, w = d - a;
  const double volume = dot(u, cross(v, w));
  const double scale = std::max({std::abs(u.x), std::abs(u.y), std::abs(u.z)}) *
                       std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) *
                       std::max({std::abs(w.x), std::abs(w.y), std::abs(w.z)});
  return std::abs(volume) > 1e-3 * scale ? volume : exact_six_volume(a, b, c, d);
}

bool finite(const Vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

// Whether the corners are an even permutation of each other.
bool same_sense(const Triangle& a, const Triangle& b) {
  return (a[0] == b[0] && a[1] == b[1]) || (a[0] == b[1] && a[1] == b[2]) || (a[0] == b[2] && a[1] == b[0]);
}

// The mesh with its tetrahedra turned positive.
TetMesh oriented(TetMesh mesh) {
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (!finite(mesh.vertices[v]))
      throw Error("vertex " + std::to_string(v) + " has a coordinate that is not finite; correct it");
  for (std::size_t t = 0; t < mesh.tets.size(); ++t)
    for (const Index v : mesh.tets[t])
      if (v >= mesh.vertices.size())
        throw Error("tetrahedron " + std::to_string(t) + " names vertex " + std::to_string(v) + " of " +
                    std::to_string(mesh.vertices.size()) + "; correct the file");
  parallel_each(mesh.tets.size(), [&](std::size_t t) {
    Tetrahedron& v = mesh.tets[t];
    const auto& q = mesh.vertices;
    if (six_volume(q[v[0]], q[v[1]], q[v[2]], q[v[3]]) < 0) std::swap(v[2], v[3]);
  });
  return mesh;
}

std::vector<double> volumes_of(const TetMesh& mesh) {
  std::vector<double> volumes(mesh.tets.size());
  parallel_each(mesh.tets.size(), [&](std::size_t t) {
    const Tetrahedron& v = mesh.tets[t];
    const auto& q = mesh.vertices;
    volumes[t] = six_volume(q[v[0]], q[v[1]], q[v[2]], q[v[3]]);
  });
  if (std::none_of(volumes.begin(), volumes.end(), [](double volume) { return volume > 0; }))
    throw Error("the mesh has no tetrahedron with volume; there is nothing to mesh");
  return volumes;
}

// Throws where two tetrahedra lie on the same side of their common facet.
void check_sides(const std::vector<Tetrahedron>& tets, const std::vector<std::array<Index, 4>>& adjacent) {
  for (Index t = 0; t < tets.size(); ++t)
    for (int k = 0; k < 4; ++k) {
      const Index other = adjacent[t][static_cast<std::size_t>(k)];
      if (other == kNone || other < t) continue;
      const Triangle corners = facet_of(tets[t], k);
      for (int l = 0; l < 4; ++l)
        if (adjacent[other][static_cast<std::size_t>(l)] == t && same_sense(corners, facet_of(tets[other], l)))
          throw Error("the tetrahedra " + std::to_string(t) + " and " + std::to_string(other) +
                      " lie on the same side of their common facet; repair the mesh");
    }
}

std::vector<std::array<Index, 4>> adjacency_of(const TetMesh& mesh, const std::vector<double>& six_volumes) {
  std::vector<Tetrahedron> kept;
  std::vector<Index> index;
  for (Index t = 0; t < mesh.tets.size(); ++t)
    if (six_volumes[t] > 0) {
      kept.push_back(mesh.tets[t]);
      index.push_back(t);
    }
  const std::vector<std::array<Index, 4>> among_kept = tet_adjacency(kept);
  std::vector<std::array<Index, 4>> adjacent(mesh.tets.size(), {kNone, kNone, kNone, kNone});
  for (std::size_t t = 0; t < kept.size(); ++t)
    for (std::size_t k = 0; k < 4; ++k)
      if (among_kept[t][k] != kNone) adjacent[index[t]][k] = index[among_kept[t][k]];
  check_sides(mesh.tets, adjacent);
  return adjacent;
}

// Calls visit(tetrahedron, facet) for the facets of the boundary.
template <class Visit>
void each_boundary_facet(const Solid& solid, const Visit& visit) {
  for (Index t = 0; t < solid.mesh.tets.size(); ++t)
    for (int k = 0; k < 4; ++k)
      if (solid.six_volumes[t] > 0 && solid.adjacent[t][static_cast<std::size_t>(k)] == kNone) visit(t, k);
}

TriangleMesh boundary_of(const Solid& solid) {
  TriangleMesh boundary;
  boundary.vertices = solid.mesh.vertices;
  each_boundary_facet(solid, [&](Index t, int k) { boundary.triangles.push_back(facet_of(solid.mesh.tets[t], k)); });
  return boundary;
}

}  // namespace

Solid::Solid(TetMesh given, std::vector<double> given_density)
    : mesh(oriented(std::move(given))), density(std::move(given_density)), six_volumes(volumes_of(mesh)),
      adjacent(adjacency_of(mesh, six_volumes)), boundary(boundary_of(*this), density) {
  each_boundary_facet(*this, [&](Index t, int) { tet_of_triangle.push_back(t); });
  volume = kSixth * fixed_sum(six_volumes.size(), [&](std::size_t t) { return six_volumes[t]; });
  mass = volume;
  if (!density.empty())
    mass = kTwentyFourth * fixed_sum(six_volumes.size(), [&](std::size_t t) {
             const Tetrahedron& v = mesh.tets[t];
             return six_volumes[t] * (density[v[0]] + density[v[1]] + density[v[2]] + density[v[3]]);
           });
  box = boundary.box;
  const double size = box.diagonal();
  const Vec3 corner = box.lo - Vec3{0.5 * size, 0.5 * size, 0.5 * size};
  enclosure = {corner, corner + Vec3{8 * size, 0, 0}, corner + Vec3{0, 8 * size, 0}, corner + Vec3{0, 0, 8 * size}};
}

}  // namespace bisector
