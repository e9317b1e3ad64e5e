#include "tetmesh/conform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "bisector/error.h"
#include "tetmesh/carve.h"
#include "tetmesh/insert_points.h"
#include "voronoi/delaunay_tets.h"
#include "spatial/hilbert.h"
#include "spatial/seed_tree.h"

namespace bisector {

namespace {

void check_points(const std::vector<Vec3>& vertices) {
  std::vector<std::size_t> order(vertices.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t v) { return std::tuple(vertices[v].x, vertices[v].y, vertices[v].z, v); };
  for (std::size_t v = 0; v < vertices.size(); ++v)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(vertices[v][k]))
        throw Error(fmt::format("vertex {}: a coordinate is not finite; mend the vertex", v));
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  for (std::size_t i = 1; i < order.size(); ++i)
    if (vertices[order[i]] == vertices[order[i - 1]])
      throw Error(fmt::format("the vertices {} and {} lie at the same point; merge them", order[i - 1], order[i]));
}

// The Delaunay tetrahedra of the vertices with `used`, and those of them inside the boundary.
Carved delaunay_inside(const std::vector<Vec3>& vertices, const std::vector<char>& used,
                       const std::vector<Triangle>& boundary) {
  std::vector<Index> active;
  std::vector<Vec3> positions;
  for (Index v = 0; v < vertices.size(); ++v)
    if (used[v]) {
      active.push_back(v);
      positions.push_back(vertices[v]);
    }
  std::vector<Tetrahedron> all = delaunay_tets(positions);
  for (Tetrahedron& t : all)
    for (Index& v : t) v = active[v];
  return carve(all, boundary);
}

// A triangle whose diametral sphere is empty is a Delaunay facet.
class Encroachment {
 public:
  explicit Encroachment(const std::vector<Vec3>& points) : order_(hilbert_order(points)) {
    for (const Index i : order_) sorted_.push_back(points[i]);
    tree_.build(sorted_);
  }

  // The points in the diametral sphere of a triangle, and some on it.
  template <class Found>
  void each_in_sphere(const Vec3& a, const Vec3& b, const Vec3& c, const Found& found) {
    const Vec3 u = b - a, v = c - a, n = cross(u, v);
    const Vec3 to_centre = (0.5 / norm2(n)) * cross(norm2(u) * v - norm2(v) * u, n);
    const Vec3 centre = a + to_centre;
    const double radius = (1 + 1e-6) * norm(to_centre);
    near_.clear();
    tree_.near({centre, centre}, radius, near_);
    for (const Index i : near_)
      if (norm2(sorted_[i] - centre) <= radius * radius) found(order_[i]);
  }

 private:
  std::vector<Index> order_;
  std::vector<Vec3> sorted_;
  SeedTree tree_;
  std::vector<Index> near_;
};

// Puts the boundary's vertices first, then the points, then all others. `vertex`: of each point, or kNone.
TetMesh in_order(TetMesh mesh, std::size_t boundary, const std::vector<Index>& vertex) {
  std::vector<Index> place(mesh.vertices.size(), kNone);
  auto next = static_cast<Index>(boundary);
  for (Index v = 0; v < next; ++v) place[v] = v;
  for (const Index v : vertex)
    if (v != kNone) place[v] = next++;
  for (Index& at : place)
    if (at == kNone) at = next++;
  const std::vector<Vec3> vertices = mesh.vertices;
  for (std::size_t v = 0; v < vertices.size(); ++v) mesh.vertices[place[v]] = vertices[v];
  for (Tetrahedron& t : mesh.tets)
    for (Index& v : t) v = place[v];
  return mesh;
}

}  // namespace

ConformingTets conforming_tets(const TriangleMesh& boundary, const std::vector<Vec3>& points,
                               const TetgenOptions& options, const Context& context) {
  ConformingTets result;
  const std::size_t count = boundary.vertices.size();
  std::vector<Vec3> vertices = boundary.vertices;
  vertices.insert(vertices.end(), points.begin(), points.end());
  check_points(vertices);
  std::vector<char> used(vertices.size(), 0);  // not: vertices that no triangle uses
  std::fill(used.begin() + static_cast<std::ptrdiff_t>(count), used.end(), char{1});
  for (const Triangle& t : boundary.triangles)
    for (const Index v : t) used[v] = 1;

  Carved carved = delaunay_inside(vertices, used, boundary.triangles);
  result.missing = carved.missing.size();
  result.delaunay = carved.missing.empty();
  if (!carved.missing.empty() && !points.empty()) {
    Encroachment encroachment(points);
    for (bool changed = true; changed && !carved.missing.empty();) {
      context.check();
      changed = false;
      for (const Index t : carved.missing) {
        const Triangle& corners = boundary.triangles[t];
        encroachment.each_in_sphere(vertices[corners[0]], vertices[corners[1]], vertices[corners[2]], [&](Index i) {
          changed |= used[count + i] != 0;
          used[count + i] = 0;
        });
      }
      if (changed) carved = delaunay_inside(vertices, used, boundary.triangles);
    }
  }
  context.check();

  std::vector<Index> vertex(points.size(), kNone);  // of each point
  if (carved.missing.empty()) {
    std::vector<char> inside(vertices.size(), 0);
    for (const Tetrahedron& t : carved.tets)
      for (const Index v : t) inside[v] = 1;
    std::vector<Index> place(vertices.size(), kNone);
    result.mesh.vertices = boundary.vertices;
    std::iota(place.begin(), place.begin() + static_cast<std::ptrdiff_t>(count), Index{0});
    for (std::size_t i = 0; i < points.size(); ++i)
      if (inside[count + i]) {
        place[count + i] = vertex[i] = static_cast<Index>(result.mesh.vertices.size());
        result.mesh.vertices.push_back(points[i]);
      }
    for (Tetrahedron& t : carved.tets)
      for (Index& v : t) v = place[v];
    result.mesh.tets = std::move(carved.tets);
    result.mesh.boundary = boundary.triangles;
    result.mesh.boundary_labels = boundary.labels;
    result.mesh.feature_edges = boundary.feature_edges;
  } else {
    if (find_tetgen().empty() && options.program.empty())
      throw Error(fmt::format("{} of {} boundary triangles are no Delaunay facets (first: {}), and TetGen, which could "
                              "fit tetrahedra to them, is not there; build with BISECTOR_TETGEN or set BISECTOR_TETGEN "
                              "to the path of bisector-tetgen",
                              carved.missing.size(), boundary.triangles.size(), carved.missing.front()));
    TetgenResult tets = tetgen_tets(boundary, options, context);
    if (tets.zero_volume > 0)
      throw Error(fmt::format("TetGen gave {} flat tetrahedra where boundary triangles are no Delaunay facets; ask for "
                              "more vertices",
                              tets.zero_volume));
    result.mesh = std::move(tets.mesh);
    result.steiner_points = tets.steiner_points;
    std::fill(used.begin() + static_cast<std::ptrdiff_t>(count), used.end(), char{0});
  }

  std::vector<Vec3> late;
  std::vector<Index> late_points, late_vertices;
  for (Index i = 0; i < points.size(); ++i)
    if (!used[count + i]) {
      late.push_back(points[i]);
      late_points.push_back(i);
    }
  if (!late.empty()) {
    result.mesh = insert_points(result.mesh, late, late_vertices, context);
    for (std::size_t k = 0; k < late.size(); ++k) vertex[late_points[k]] = late_vertices[k];
    result.mesh = in_order(std::move(result.mesh), count, vertex);
  }
  for (Index i = 0; i < points.size(); ++i)
    if (vertex[i] == kNone) result.refused.push_back(i);
  return result;
}

}  // namespace bisector
