#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "bisector/quality.h"
#include "core/degenerate.h"
#include "core/geometry.h"
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
    return std::tuple(p.x, p.y, p.z, v);
  };
  sort_in_parallel(order, [&](Index a, Index b) { return key(a) < key(b); });
  std::vector<char> has_area(mesh.triangles.size());
  parallel_each(mesh.triangles.size(), [&](std::size_t i) {
    const auto [a, b, c] = mesh.triangles[i];
    has_area[i] = !collinear(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
  });

  TriangleMesh welded;
  std::vector<Index> vertex(mesh.vertices.size());
  for (const Index v : order) {
    if (welded.vertices.empty() || !(welded.vertices.back() == mesh.vertices[v]))
      welded.vertices.push_back(mesh.vertices[v]);
    vertex[v] = static_cast<Index>(welded.vertices.size() - 1);
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    if (!has_area[i]) continue;
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

// Space between planes across the widest extent of a mesh, with about as many triangles that begin in each slab. A pair
// of boxes belongs to the slab in which the second of the two begins.
class Slabs {
 public:
  explicit Slabs(const TriangleMesh& welded) : boxes_(welded.triangles.size()) {
    parallel_each(boxes_.size(), [&](std::size_t i) {
      CGAL::Bbox_3 box;
      for (const Index v : welded.triangles[i]) {
        const Vec3& p = welded.vertices[v];
        box += CGAL::Bbox_3(p.x, p.y, p.z, p.x, p.y, p.z);
      }
      boxes_[i] = TriangleBox(box, i);
    });
    const Box box = bounding_box(welded);
    for (int k = 1; k < 3; ++k)
      if (box.hi[k] - box.lo[k] > box.hi[axis_] - box.lo[axis_]) axis_ = k;
    std::vector<double> begins(boxes_.size());
    parallel_each(boxes_.size(), [&](std::size_t i) { begins[i] = boxes_[i].min_coord(axis_); });
    sort_in_parallel(begins, std::less<>());
    const std::size_t count = std::clamp<std::size_t>(boxes_.size() / kLeastInSlab, 1, kMostSlabs);
    for (std::size_t k = 1; k < count; ++k) planes_.push_back(begins[k * begins.size() / count]);
    planes_.erase(std::unique(planes_.begin(), planes_.end()), planes_.end());
    first_.resize(boxes_.size());
    last_.resize(boxes_.size());
    parallel_each(boxes_.size(), [&](std::size_t i) {
      first_[i] = static_cast<std::uint8_t>(slab_of(boxes_[i].min_coord(axis_)));
      last_[i] = static_cast<std::uint8_t>(slab_of(boxes_[i].max_coord(axis_)));
    });
  }

  std::size_t size() const { return planes_.size() + 1; }

  // Calls visit(pair) for the slab's pairs of boxes that overlap.
  template <class Visit>
  void visit_overlaps(std::size_t slab, const Visit& visit) const {
    std::vector<TriangleBox> within;
    for (std::size_t i = 0; i < boxes_.size(); ++i)
      if (first_[i] <= slab && last_[i] >= slab) within.push_back(boxes_[i]);
    CGAL::box_self_intersection_d(within.begin(), within.end(), [&](const TriangleBox& a, const TriangleBox& b) {
      const Pair pair{a.info(), b.info()};
      if (std::max(first_[pair[0]], first_[pair[1]]) == slab) visit(pair);
    });
  }

 private:
  static constexpr std::size_t kLeastInSlab = 4096, kMostSlabs = 64;

  std::size_t slab_of(double coordinate) const {
    return static_cast<std::size_t>(std::upper_bound(planes_.begin(), planes_.end(), coordinate) - planes_.begin());
  }

  std::vector<TriangleBox> boxes_;
  int axis_ = 0;
  std::vector<double> planes_;              // between the slabs, ascending
  std::vector<std::uint8_t> first_, last_;  // slabs that each box reaches
};

// The pairs of welded triangles that intersect: `take(slab, pair)` is called for each, for all slabs at once.
template <class Take>
void take_intersections(const TriangleMesh& welded, const Slabs& slabs, const Context& context, const Take& take) {
  parallel_each(
      slabs.size(),
      [&](std::size_t slab) {
        context.check();
        slabs.visit_overlaps(slab, [&](const Pair& pair) {
          context.check();
          const auto [s, t] = pair;
          if (intersect_beyond_shared(welded.vertices, welded.triangles[s], welded.triangles[t])) take(slab, pair);
        });
      },
      1);
}

}  // namespace

std::size_t count_self_intersections(const TriangleMesh& mesh, const Context& context) {
  const TriangleMesh welded = merge_equal_points(mesh);
  const Slabs slabs(welded);
  std::vector<std::size_t> counts(slabs.size(), 0);
  take_intersections(welded, slabs, context, [&](std::size_t slab, const Pair&) { ++counts[slab]; });
  return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
}

std::vector<std::array<Index, 2>> find_self_intersections(const TriangleMesh& mesh, const Context& context) {
  const TriangleMesh welded = merge_equal_points(mesh);
  const Slabs slabs(welded);
  std::vector<std::vector<std::array<Index, 2>>> found(slabs.size());
  take_intersections(welded, slabs, context, [&](std::size_t slab, const Pair& pair) {
    const auto [low, high] = std::minmax(pair[0], pair[1]);
    found[slab].push_back({welded.face_of_triangle[low], welded.face_of_triangle[high]});
  });
  std::vector<std::array<Index, 2>> pairs;
  for (const auto& of_slab : found) pairs.insert(pairs.end(), of_slab.begin(), of_slab.end());
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace bisector
