#include "mesh/face_contacts.h"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/geometry.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

using TriangleBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, Index>;

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
  const Vec3 doubled = cross(b - a, c - a);
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
  const Index first = mesh.triangles.empty() ? kNone : component[mesh.triangles[0][0]];
  if (std::all_of(component.begin(), component.end(), [&](Index c) { return c == first || c == kNone; })) return 0;
  std::vector<Facet> facets(mesh.triangles.size());
  std::vector<TriangleBox> boxes;
  for (Index t = 0; t < facets.size(); ++t) {
    facets[t] = facet_of(mesh, t);
    CGAL::Bbox_3 box;
    for (const Vec3& p : facets[t].corners)
      box +=
          CGAL::Bbox_3(p.x - rounding, p.y - rounding, p.z - rounding, p.x + rounding, p.y + rounding, p.z + rounding);
    boxes.emplace_back(box, t);
  }
  std::vector<double> recedes(facets.size(), 0);
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const TriangleBox& a, const TriangleBox& b) {
    const std::array<Index, 2> pair{a.info(), b.info()};
    if (component[mesh.triangles[pair[0]][0]] == component[mesh.triangles[pair[1]][0]]) return;
    const bool swap = facets[pair[0]].area < facets[pair[1]].area;
    const Facet &large = facets[pair[swap]], &small = facets[pair[!swap]];
    if (!(dot(large.normal, small.normal) < kFacing)) return;
    double depth = 0;
    for (const Vec3& p : small.corners) {
      const double height = dot(large.normal, p - large.corners[0]);
      if (std::abs(height) > rounding) return;
      depth = std::max(depth, -height);
    }
    if (!overlap(large, small, large.normal, rounding)) return;
    for (const Index t : pair) recedes[t] = std::max(recedes[t], 0.5 * (depth + apart));
  });
  std::vector<std::vector<Recession>> of_vertex(mesh.vertices.size());
  std::size_t count = 0;
  for (Index t = 0; t < facets.size(); ++t) {
    if (recedes[t] == 0) continue;
    ++count;
    for (const Index v : mesh.triangles[t]) add(of_vertex[v], facets[t].normal, recedes[t]);
  }
  for (Index v = 0; v < of_vertex.size(); ++v)
    if (!of_vertex[v].empty()) mesh.vertices[v] += way_of(of_vertex[v]);
  return count;
}

}  // namespace bisector
