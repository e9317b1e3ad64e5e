#include "mesh/face_contacts.h"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/geometry.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

// Of a facet or a component.
using IndexedBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::size_t>;

// Of normals that face each other; triangles that are small beside their rounding are not parallel.
constexpr double kFacing = -0.9;
// Normals that are as good as one.
constexpr double kSame = 0.9999;
// How much farther a vertex may go than its triangles are to, where they meet at a small angle.
constexpr double kFarthest = 8;
constexpr int kMostSteps = 100;

struct Facet {
  std::array<Vec3, 3> corners;
  Vec3 normal;  // of length one; zero if the triangle has no area
  double area = 0;
};

Facet facet_of(const TriangleMesh& mesh, Index t) {
  Facet facet;
  for (std::size_t k = 0; k < 3; ++k) facet.corners[k] = mesh.vertices[mesh.triangles[t][k]];
  const auto& [a, b, c] = facet.corners;
  const Vec3 doubled = twice_area_normal(a, b, c);
  facet.area = norm(doubled);
  if (facet.area > 0) facet.normal = (1 / facet.area) * doubled;
  return facet;
}

// Whether the shadows of two triangles along the normal of one of them overlap by more than `least` across each edge.
bool overlap(const Facet& f, const Facet& g, const Vec3& normal, double least) {
  for (const Facet* of : {&f, &g})
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 edge = of->corners[(k + 1) % 3] - of->corners[k], across = cross(normal, edge);
      const double length = norm(across);
      if (!(length > 0)) return false;
      std::array<double, 2> low, high;
      for (std::size_t side = 0; side < 2; ++side) {
        const auto& corners = (side == 0 ? f : g).corners;
        const auto [lowest, highest] = std::minmax(
            {dot(across, corners[0]) / length, dot(across, corners[1]) / length, dot(across, corners[2]) / length});
        low[side] = lowest;
        high[side] = highest;
      }
      if (std::min(high[0] - low[1], high[1] - low[0]) <= least) return false;
    }
  return true;
}

// How far the smaller of two facets lies behind the larger, if they are in contact.
std::optional<double> depth_of_contact(const Facet& large, const Facet& small, double rounding) {
  if (!(dot(large.normal, small.normal) < kFacing)) return std::nullopt;
  double depth = 0;
  for (const Vec3& p : small.corners) {
    const double height = dot(large.normal, p - large.corners[0]);
    if (std::abs(height) > rounding) return std::nullopt;
    depth = std::max(depth, -height);
  }
  if (!overlap(large, small, large.normal, rounding)) return std::nullopt;
  return depth;
}

CGAL::Bbox_3 box_around(const Vec3& p, double by) {
  return {p.x - by, p.y - by, p.z - by, p.x + by, p.y + by, p.z + by};
}

CGAL::Bbox_3 box_around(const Facet& facet, double by) {
  return box_around(facet.corners[0], by) + box_around(facet.corners[1], by) + box_around(facet.corners[2], by);
}

CGAL::Bbox_3 common_part(const CGAL::Bbox_3& a, const CGAL::Bbox_3& b) {
  return {std::max(a.xmin(), b.xmin()), std::max(a.ymin(), b.ymin()), std::max(a.zmin(), b.zmin()),
          std::min(a.xmax(), b.xmax()), std::min(a.ymax(), b.ymax()), std::min(a.zmax(), b.zmax())};
}

// Of each component a box that holds all that its own box, enlarged by rounding, has in common with those of others.
std::vector<CGAL::Bbox_3> where_components_meet(const TriangleMesh& mesh, const std::vector<Index>& component,
                                                double rounding) {
  std::vector<CGAL::Bbox_3> whole;
  for (Index v = 0; v < component.size(); ++v) {
    if (component[v] == kNone) continue;
    if (component[v] >= whole.size()) whole.resize(component[v] + std::size_t{1});
    whole[component[v]] += box_around(mesh.vertices[v], rounding);
  }
  std::vector<IndexedBox> boxes;
  for (std::size_t c = 0; c < whole.size(); ++c) boxes.emplace_back(whole[c], c);
  std::vector<CGAL::Bbox_3> meeting(whole.size());
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const IndexedBox& a, const IndexedBox& b) {
    for (const std::size_t c : {a.info(), b.info()}) meeting[c] += common_part(a.bbox(), b.bbox());
  });
  return meeting;
}

// How a vertex has to move: by `distance` at least against the normal.
struct Recession {
  Vec3 normal;
  double distance;
};

void add(std::vector<Recession>& all, const Vec3& normal, double distance) {
  for (Recession& r : all)
    if (dot(r.normal, normal) > kSame) {
      r.distance = std::max(r.distance, distance);
      return;
    }
  all.push_back({normal, distance});
}

// A short way that satisfies all of them, by steps onto the plane that is farthest from being satisfied (Motzkin and
// Schoenberg 1954, "The relaxation method for linear inequalities", Canadian Journal of Mathematics 6).
Vec3 way_of(const std::vector<Recession>& all) {
  Vec3 way{};
  double longest = 0;
  for (const Recession& r : all) longest = std::max(longest, r.distance);
  for (int step = 0; step < kMostSteps; ++step) {
    const Recession* worst = nullptr;
    double missing = 0.01 * longest;
    for (const Recession& r : all)
      if (const double m = r.distance + dot(r.normal, way); m > missing) {
        missing = m;
        worst = &r;
      }
    if (worst == nullptr) break;
    way -= missing * worst->normal;
  }
  const double length = norm(way), most = kFarthest * longest;
  return length > most ? (most / length) * way : way;
}

}  // namespace

std::size_t open_face_contacts(TriangleMesh& mesh, double rounding, double apart) {
  const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  const std::vector<CGAL::Bbox_3> meeting = where_components_meet(mesh, component, rounding);
  std::vector<Facet> facets;
  std::vector<Index> triangle;  // of each facet
  std::vector<IndexedBox> boxes;
  for (Index t = 0; t < mesh.triangles.size(); ++t) {
    const Facet facet = facet_of(mesh, t);
    const CGAL::Bbox_3 box = box_around(facet, rounding);
    if (!CGAL::do_overlap(box, meeting[component[mesh.triangles[t][0]]])) continue;
    boxes.emplace_back(box, facets.size());
    facets.push_back(facet);
    triangle.push_back(t);
  }
  std::vector<double> recedes(facets.size(), 0);
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const IndexedBox& a, const IndexedBox& b) {
    const std::array<std::size_t, 2> pair{a.info(), b.info()};
    if (component[mesh.triangles[triangle[pair[0]]][0]] == component[mesh.triangles[triangle[pair[1]]][0]]) return;
    const bool swap = facets[pair[0]].area < facets[pair[1]].area;
    const std::optional<double> depth = depth_of_contact(facets[pair[swap]], facets[pair[!swap]], rounding);
    if (!depth) return;
    for (const std::size_t f : pair) recedes[f] = std::max(recedes[f], 0.5 * (*depth + apart));
  });
  std::size_t count = 0;
  std::unordered_map<Index, std::vector<Recession>> of_vertex;
  for (std::size_t f = 0; f < facets.size(); ++f) {
    if (recedes[f] == 0) continue;
    ++count;
    for (const Index v : mesh.triangles[triangle[f]]) add(of_vertex[v], facets[f].normal, recedes[f]);
  }
  for (const auto& [v, recessions] : of_vertex) mesh.vertices[v] += way_of(recessions);
  return count;
}

}  // namespace bisector
