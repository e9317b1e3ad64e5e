#include "tetmesh/conform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "bisector/error.h"
#include "spatial/hilbert.h"
#include "spatial/seed_tree.h"
#include "tetmesh/carve.h"
#include "tetmesh/insert_points.h"
#include "voronoi/delaunay_tets.h"

namespace bisector {

namespace {

constexpr double kSphereMargin = 1 + 1e-6;  // factor of a sphere's radius that covers rounding

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
    const double radius = kSphereMargin * norm(to_centre);
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

// The boundary's vertices and the points, and which of them the Delaunay triangulation is made of.
struct Candidates {
  Candidates(const TriangleMesh& boundary, const std::vector<Vec3>& points)
      : first_point(boundary.vertices.size()), vertices(boundary.vertices) {
    vertices.insert(vertices.end(), points.begin(), points.end());
    check_points(vertices);
    used.assign(vertices.size(), 0);
    std::fill(used.begin() + static_cast<std::ptrdiff_t>(first_point), used.end(), char{1});
    for (const Triangle& t : boundary.triangles)
      for (const Index v : t) used[v] = 1;
  }

  bool uses_point(std::size_t i) const { return used[first_point + i] != 0; }
  // False if it was left out already.
  bool leave_out_point(std::size_t i) { return std::exchange(used[first_point + i], char{0}) != 0; }

  std::size_t first_point;  // index of the first point among the vertices
  std::vector<Vec3> vertices;
  std::vector<char> used;  // not: vertices that no triangle of the boundary has, and points left out
};

// Leaves out points in the diametral spheres of missing triangles until no triangle is missing or no such point is
// left. `carved` then belongs to the points that stay.
void leave_out_encroaching(const TriangleMesh& boundary, const std::vector<Vec3>& points, const Context& context,
                           Candidates& candidates, Carved& carved) {
  if (carved.missing.empty() || points.empty()) return;
  Encroachment encroachment(points);
  for (bool changed = true; changed && !carved.missing.empty();) {
    context.check();
    changed = false;
    for (const Index t : carved.missing) {
      const auto [a, b, c] = boundary.triangles[t];
      encroachment.each_in_sphere(boundary.vertices[a], boundary.vertices[b], boundary.vertices[c],
                                  [&](Index i) { changed |= candidates.leave_out_point(i); });
    }
    if (changed) carved = delaunay_inside(candidates.vertices, candidates.used, boundary.triangles);
  }
}

// Takes the tetrahedra inside the boundary, with those of the points that they have as corners. `vertex` becomes the
// vertex of each of these.
TetMesh take_delaunay(const TriangleMesh& boundary, const std::vector<Vec3>& points, std::vector<Tetrahedron> tets,
                      std::vector<Index>& vertex) {
  const std::size_t count = boundary.vertices.size();
  std::vector<char> inside(count + points.size(), 0);
  for (const Tetrahedron& t : tets)
    for (const Index v : t) inside[v] = 1;
  TetMesh mesh;
  mesh.vertices = boundary.vertices;
  std::vector<Index> place(count + points.size(), kNone);
  std::iota(place.begin(), place.begin() + static_cast<std::ptrdiff_t>(count), Index{0});
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!inside[count + i]) continue;
    place[count + i] = vertex[i] = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.push_back(points[i]);
  }
  for (Tetrahedron& t : tets)
    for (Index& v : t) v = place[v];
  mesh.tets = std::move(tets);
  mesh.boundary = boundary.triangles;
  mesh.boundary_labels = boundary.labels;
  mesh.feature_edges = boundary.feature_edges;
  return mesh;
}

// TetGen's tetrahedra of the boundary alone, for where some of its triangles are missing whatever points are left out.
TetgenResult fill_by_tetgen(const TriangleMesh& boundary, const std::vector<Index>& missing,
                            const TetgenOptions& options, const Context& context) {
  if (find_tetgen().empty() && options.program.empty())
    throw Error(
        fmt::format("{} of {} boundary triangles are no Delaunay facets (first: {}), and TetGen, which could "
                    "fit tetrahedra to them, is not there; build with BISECTOR_TETGEN or set BISECTOR_TETGEN "
                    "to the path of bisector-tetgen",
                    missing.size(), boundary.triangles.size(), missing.front()));
  TetgenResult tets = tetgen_tets(boundary, options, context);
  if (tets.zero_volume > 0)
    throw Error(
        fmt::format("TetGen gave {} flat tetrahedra where boundary triangles are no Delaunay facets; ask for "
                    "more vertices",
                    tets.zero_volume));
  return tets;
}

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

// Puts the points that were left out into the mesh, as far as they fit.
void insert_left_out(const std::vector<Vec3>& points, const Candidates& candidates, const Context& context,
                     TetMesh& mesh, std::vector<Index>& vertex) {
  std::vector<Vec3> late;
  std::vector<Index> late_points, late_vertices;
  for (Index i = 0; i < points.size(); ++i) {
    if (candidates.uses_point(i)) continue;
    late.push_back(points[i]);
    late_points.push_back(i);
  }
  if (late.empty()) return;
  mesh = insert_points(mesh, late, late_vertices, context);
  for (std::size_t k = 0; k < late.size(); ++k) vertex[late_points[k]] = late_vertices[k];
  mesh = in_order(std::move(mesh), candidates.first_point, vertex);
}

}  // namespace

ConformingTets conforming_tets(const TriangleMesh& boundary, const std::vector<Vec3>& points,
                               const TetgenOptions& options, const Context& context) {
  ConformingTets result;
  Candidates candidates(boundary, points);
  Carved carved = delaunay_inside(candidates.vertices, candidates.used, boundary.triangles);
  result.missing = carved.missing.size();
  result.delaunay = carved.missing.empty();
  leave_out_encroaching(boundary, points, context, candidates, carved);
  context.check();

  std::vector<Index> vertex(points.size(), kNone);  // of each point
  if (carved.missing.empty()) {
    result.mesh = take_delaunay(boundary, points, std::move(carved.tets), vertex);
  } else {
    TetgenResult tets = fill_by_tetgen(boundary, carved.missing, options, context);
    result.mesh = std::move(tets.mesh);
    result.steiner_points = tets.steiner_points;
    for (std::size_t i = 0; i < points.size(); ++i) candidates.leave_out_point(i);
  }
  insert_left_out(points, candidates, context, result.mesh, vertex);
  for (Index i = 0; i < points.size(); ++i)
    if (vertex[i] == kNone) result.refused.push_back(i);
  return result;
}

}  // namespace bisector
