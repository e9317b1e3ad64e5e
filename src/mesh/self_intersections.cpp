#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "bisector/quality.h"
#include "core/degenerate.h"
#include "core/parallel.h"

namespace bisector {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using TriangleBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::size_t>;
using Pair = std::array<std::size_t, 2>;

// The triangles that have an area, over vertices of which no two lie at the same point; face_of_triangle tells which
// they are.
TriangleMesh merge_equal_points(const TriangleMesh& mesh) {
  std::vector<Index> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), Index{0});
  const auto key = [&](Index v) {
    const Vec3& p = mesh.vertices[v];
    return std::tuple(p.x, p.y, p.z);
  };
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return key(a) < key(b); });

  TriangleMesh welded;
  std::vector<Index> vertex(mesh.vertices.size());
  for (const Index v : order) {
    if (welded.vertices.empty() || !(welded.vertices.back() == mesh.vertices[v]))
      welded.vertices.push_back(mesh.vertices[v]);
    vertex[v] = static_cast<Index>(welded.vertices.size() - 1);
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    if (collinear(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])) continue;
    welded.triangles.push_back({vertex[t[0]], vertex[t[1]], vertex[t[2]]});
    welded.face_of_triangle.push_back(static_cast<Index>(i));
  }
  return welded;
}

// Moves the vertices that both triangles have to the front of each, in the same order; returns how many.
int align_shared(Triangle& s, Triangle& t) {
  int shared = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = shared; j < 3; ++j)
      if (s[i] == t[j]) {
        std::swap(s[i], s[shared]);
        std::swap(t[j], t[shared]);
        ++shared;
        break;
      }
  return shared;
}

bool intersect_beyond_shared(const std::vector<Vec3>& vertices, Triangle s, Triangle t) {
  const auto point = [&](Index v) { return Kernel::Point_3(vertices[v].x, vertices[v].y, vertices[v].z); };
  const auto whole = [&](const Triangle& r) { return Kernel::Triangle_3(point(r[0]), point(r[1]), point(r[2])); };
  const auto opposite = [&](const Triangle& r) { return Kernel::Segment_3(point(r[1]), point(r[2])); };
  switch (align_shared(s, t)) {
    case 0: return CGAL::do_intersect(whole(s), whole(t));
    // A second common point p gives a common segment; the ray to p leaves the smaller part through an opposite edge.
    case 1: return CGAL::do_intersect(whole(s), opposite(t)) || CGAL::do_intersect(whole(t), opposite(s));
    case 2:
      return CGAL::coplanar(point(s[0]), point(s[1]), point(s[2]), point(t[2])) &&
             CGAL::coplanar_orientation(point(s[0]), point(s[1]), point(s[2]), point(t[2])) == CGAL::POSITIVE;
    default: return true;
  }
}

// Calls visit(pair) for every pair of welded triangles that intersect.
template <class Visit>
void visit_intersections(const TriangleMesh& welded, const Context& context, const Visit& visit) {
  std::vector<TriangleBox> boxes;
  boxes.reserve(welded.triangles.size());
  for (std::size_t i = 0; i < welded.triangles.size(); ++i) {
    CGAL::Bbox_3 box;
    for (const Index v : welded.triangles[i]) {
      const Vec3& p = welded.vertices[v];
      box += CGAL::Bbox_3(p.x, p.y, p.z, p.x, p.y, p.z);
    }
    boxes.emplace_back(box, i);
  }

  std::vector<Pair> candidates;
  std::vector<char> intersect;
  const auto test_candidates = [&] {
    intersect.resize(candidates.size());
    parallel_each(candidates.size(), [&](std::size_t i) {
      context.check();
      const auto [s, t] = candidates[i];
      intersect[i] = intersect_beyond_shared(welded.vertices, welded.triangles[s], welded.triangles[t]);
    });
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (intersect[i]) visit(candidates[i]);
    candidates.clear();
  };
  context.check();
  constexpr std::size_t kBatch = std::size_t{1} << 20;  // bounds the memory however many boxes overlap
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const TriangleBox& a, const TriangleBox& b) {
    candidates.push_back({a.info(), b.info()});
    if (candidates.size() == kBatch) test_candidates();
  });
  test_candidates();
}

}  // namespace

std::size_t count_self_intersections(const TriangleMesh& mesh, const Context& context) {
  std::size_t count = 0;
  visit_intersections(merge_equal_points(mesh), context, [&](const Pair&) { ++count; });
  return count;
}

std::vector<std::array<Index, 2>> find_self_intersections(const TriangleMesh& mesh, const Context& context) {
  const TriangleMesh welded = merge_equal_points(mesh);
  std::vector<std::array<Index, 2>> pairs;
  visit_intersections(welded, context, [&](const Pair& pair) {
    const auto [low, high] = std::minmax(pair[0], pair[1]);
    pairs.push_back({welded.face_of_triangle[low], welded.face_of_triangle[high]});
  });
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace bisector
