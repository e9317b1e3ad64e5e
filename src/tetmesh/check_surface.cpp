#include "tetmesh/check_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "bisector/repair.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/orientation.h"
#include "mesh/topology.h"

namespace bisector {

namespace {

constexpr std::size_t kNamed = 5;

// Counts what is wrong and keeps the names of the first few.
class Offenders {
 public:
  void add(std::string name) {
    if (names_.size() < kNamed) names_.push_back(std::move(name));
    ++count_;
  }
  bool any() const { return count_ > 0; }
  // "3 edges have one triangle (1-2, 7-9, 8-9)"
  std::string list(const char* one, const char* many) const {
    std::string text = fmt::format("{} {} (", count_, count_ == 1 ? one : many);
    for (std::size_t i = 0; i < names_.size(); ++i) text += (i ? ", " : "") + names_[i];
    return text + (count_ > names_.size() ? ", ...)" : ")");
  }

 private:
  std::size_t count_ = 0;
  std::vector<std::string> names_;
};

void check_triangles(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) throw Error("the surface has no triangles; give a closed surface");
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(mesh.vertices[v][k]))
        throw Error(fmt::format("vertex {}: a coordinate is not finite; mend the vertex", v));
  Offenders flat;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    for (const Index v : t)
      if (v >= mesh.vertices.size())
        throw Error(fmt::format("triangle {}: index {} is out of range, the mesh has {} vertices; mend it", i, v,
                                mesh.vertices.size()));
    if (collinear(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])) flat.add(fmt::format("{}", i));
  }
  if (flat.any())
    throw Error("the surface has " + flat.list("triangle without area", "triangles without area") + "; remove them",
                Reason::no_solid);
}

std::string edge_name(const EdgeTable& table, std::size_t e, const std::vector<Index>& original) {
  return fmt::format("{}-{}", original[table.edges[e][0]], original[table.edges[e][1]]);
}

void check_closed(const EdgeTable& table, const std::vector<Index>& original) {
  Offenders open;
  for (std::size_t e = 0; e < table.edges.size(); ++e)
    if (table.half_edges.size(e) == 1) open.add(edge_name(table, e, original));
  if (open.any())
    throw Error("the surface is not closed: " + open.list("edge has one triangle", "edges have one triangle") +
                    "; close the holes or weld the cracks",
                Reason::open_surface);
}

void check_edges(const TriangleMesh& mesh, const EdgeTable& table, const std::vector<Index>& original) {
  check_closed(table, original);
  Offenders multiple;
  for (std::size_t e = 0; e < table.edges.size(); ++e)
    if (table.half_edges.size(e) > 2) multiple.add(edge_name(table, e, original));
  if (multiple.any())
    throw Error("the surface is not manifold: " +
                    multiple.list("edge has more than two triangles", "edges have more than two triangles") +
                    "; separate the parts that meet there, or mesh them as regions",
                Reason::no_solid);
  Offenders turned;
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    const std::size_t a = table.half_edges.begin(e)[0], b = table.half_edges.begin(e)[1];
    if (mesh.triangles[a / 3][a % 3] == mesh.triangles[b / 3][b % 3])
      turned.add(fmt::format("{}-{}", original[table.edges[e][0]], original[table.edges[e][1]]));
  }
  if (turned.any())
    throw Error("the surface has one side only: its triangles cannot be oriented alike across " +
                    turned.list("edge", "edges") + "; give the boundary of a solid",
                Reason::no_solid);
}

void check_vertices(const TriangleMesh& mesh, const std::vector<Index>& original) {
  // Around a vertex of a closed surface with two triangles at each edge, each fan is a cycle.
  std::vector<std::size_t> corners(mesh.vertices.size(), 0);
  std::vector<std::size_t> first(mesh.vertices.size(), static_cast<std::size_t>(-1));
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  std::vector<std::size_t> opposite(3 * mesh.triangles.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    const std::size_t* h = table.half_edges.begin(e);
    opposite[h[0]] = h[1];
    opposite[h[1]] = h[0];
  }
  for (std::size_t h = 0; h < opposite.size(); ++h) {
    const Index v = mesh.triangles[h / 3][h % 3];
    ++corners[v];
    if (first[v] == static_cast<std::size_t>(-1)) first[v] = h;
  }
  Offenders split;
  for (std::size_t v = 0; v < corners.size(); ++v) {
    if (corners[v] == 0) continue;
    std::size_t fan = 0, h = first[v];
    do {
      ++fan;
      const std::size_t other = opposite[h];  // ends at v; the next half-edge of its triangle starts there
      h = other % 3 == 2 ? other - 2 : other + 1;
    } while (h != first[v]);
    if (fan != corners[v]) split.add(fmt::format("{}", original[v]));
  }
  if (split.any())
    throw Error("the surface is not manifold: it touches itself at " + split.list("vertex", "vertices") +
                    "; separate the parts that meet there",
                Reason::no_solid);
}

// `name`: of each triangle; empty: its index.
void check_intersections(const TriangleMesh& mesh, const std::vector<Index>& name = {}) {
  const std::vector<std::array<Index, 2>> pairs = find_self_intersections(mesh);
  if (pairs.empty()) return;
  Offenders crossing;
  for (const auto& [a, b] : pairs)
    crossing.add(name.empty() ? fmt::format("{}-{}", a, b) : fmt::format("{}-{}", name[a], name[b]));
  throw Error("the surface intersects itself: " + crossing.list("pair of triangles meets", "pairs of triangles meet") +
                  "; mend it there",
              Reason::no_solid);
}

// How often the ray from `p` towards +x crosses triangles, none of which holds p. `p` is moved by (0, e, e^2) for an
// infinitesimal e, so that the ray meets no edge or vertex.
class Ray {
 public:
  explicit Ray(const Vec3& p) : p_(p) {}

  bool crosses(const Vec3& a, const Vec3& b, const Vec3& c) const {
    if (std::max({a.x, b.x, c.x}) < p_.x) return false;
    const int s = side(a, b);
    if (s == 0 || side(b, c) != s || side(c, a) != s) return false;
    // Seen along x the triangle turns as s says, so its plane lies ahead if p is on that side.
    return orientation(a, b, c, p_) * s < 0;
  }

 private:
  // On which side of the line from a to b, seen along x, the moved point lies; 0 if they coincide there.
  int side(const Vec3& a, const Vec3& b) const {
    if (const int s = orientation_yz(a, b, p_)) return s;
    if (a.z != b.z) return a.z > b.z ? 1 : -1;
    if (a.y != b.y) return b.y > a.y ? 1 : -1;
    return 0;
  }

  Vec3 p_;
};

void orient_shells(TriangleMesh& mesh) {
  const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  struct Shell {
    std::vector<std::size_t> triangles;
    Box box;
    Vec3 point;
  };
  std::vector<Shell> shells;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Index shell = component[mesh.triangles[i][0]];
    if (shell >= shells.size()) shells.resize(std::size_t{shell} + 1);
    shells[shell].triangles.push_back(i);
  }
  for (Shell& shell : shells) {
    std::vector<Vec3> points;
    for (const std::size_t i : shell.triangles)
      for (const Index v : mesh.triangles[i]) points.push_back(mesh.vertices[v]);
    shell.box = bounding_box(points);
    shell.point = points[0];
  }
  const auto inside = [&](const Vec3& p, const Shell& shell) {
    for (int k = 0; k < 3; ++k)
      if (p[k] < shell.box.lo[k] || p[k] > shell.box.hi[k]) return false;
    const Ray ray(p);
    bool odd = false;
    for (const std::size_t i : shell.triangles) {
      const Triangle& t = mesh.triangles[i];
      if (ray.crosses(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])) odd = !odd;
    }
    return odd;
  };
  for (std::size_t s = 0; s < shells.size(); ++s) {
    bool cavity = false;
    for (std::size_t other = 0; other < shells.size(); ++other)
      if (other != s && inside(shells[s].point, shells[other])) cavity = !cavity;
    std::vector<Triangle> triangles;
    for (const std::size_t i : shells[s].triangles) triangles.push_back(mesh.triangles[i]);
    if ((enclosed_volume_sign(mesh.vertices, triangles) > 0) != cavity) continue;
    for (const std::size_t i : shells[s].triangles) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
  }
}

// Of each vertex after welding, the first that has become it.
std::vector<Index> first_originals(const WeldResult& welded) {
  std::vector<Index> original(welded.mesh.vertices.size(), kNone);
  for (Index v = 0; v < welded.vertex_of.size(); ++v)
    if (welded.vertex_of[v] != kNone && original[welded.vertex_of[v]] == kNone) original[welded.vertex_of[v]] = v;
  return original;
}

// Of each triangle after welding, which keeps their order, the first with its corners.
std::vector<Index> first_triangles(const TriangleMesh& mesh, const WeldResult& welded) {
  std::vector<Index> original;
  for (Index t = 0; t < mesh.triangles.size() && original.size() < welded.mesh.triangles.size(); ++t) {
    Triangle corners = mesh.triangles[t];
    for (Index& v : corners) v = welded.vertex_of[v];
    if (corners == welded.mesh.triangles[original.size()]) original.push_back(t);
  }
  return original;
}

}  // namespace

TriangleMesh check_walls(const TriangleMesh& mesh) {
  check_triangles(mesh);
  WeldResult welded = weld(mesh, 0);
  const EdgeTable table = edge_table(welded.mesh.triangles, welded.mesh.vertices.size());
  check_closed(table, first_originals(welded));
  check_intersections(welded.mesh, first_triangles(mesh, welded));
  return std::move(welded.mesh);
}

TriangleMesh check_surface(const TriangleMesh& mesh) {
  check_triangles(mesh);
  WeldResult welded = weld(mesh, 0);
  const std::vector<Index> original = first_originals(welded);
  TriangleMesh surface = std::move(welded.mesh);
  orient(surface.triangles, surface.vertices.size());
  check_edges(surface, edge_table(surface.triangles, surface.vertices.size()), original);
  check_vertices(surface, original);
  check_intersections(mesh);
  orient_shells(surface);
  return surface;
}

}  // namespace bisector
