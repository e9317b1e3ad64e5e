#include "mesh/caps.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <queue>
#include <tuple>
#include <unordered_set>
#include <utility>

#include "core/geometry.h"
#include "mesh/stars.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

// Of the longest edge: what is higher is a triangle of a fine mesh.
constexpr double kFlat = 1e-3;
// Of the longest edge of a triangle that is folded back, and the cosine from its normal to that of its neighbour there.
constexpr double kFlatFold = 0.1, kFolded = -0.9;

class CapFlips {
 public:
  CapFlips(TriangleMesh& mesh, double height, double fold, const std::vector<std::array<Index, 2>>& given)
      : mesh_(mesh), height_(height), fold_(fold) {
    std::vector<Index> low;
    for (Index t = 0; t < mesh.triangles.size(); ++t)
      if (is_low(t) || is_low_for_a_fold(t)) low.push_back(t);
    if (low.empty()) return;
    for (const auto* edges : {&given, &std::as_const(mesh.feature_edges)})
      for (const auto& [a, b] : *edges) stays_.insert(edge_key(a, b));
    at_.resize(mesh.vertices.size());
    for (Index t = 0; t < mesh.triangles.size(); ++t)
      for (const Index v : mesh.triangles[t]) at_[v].push_back(t);
    for (const Index t : low) push_if_low(t);
  }

  std::size_t run() {
    std::size_t flipped = 0;
    while (!queue_.empty()) {
      const auto [height, t] = queue_.top();
      queue_.pop();
      if (height == height_of(mesh_.triangles[t])) flipped += flip(t);
    }
    return flipped;
  }

 private:
  using Low = std::tuple<double, Index>;  // height, triangle

  const Vec3& at(Index v) const { return mesh_.vertices[v]; }

  // The first of the two corners of the longest edge.
  std::size_t longest_edge(const Triangle& v) const {
    std::array<double, 3> squares;
    for (std::size_t k = 0; k < 3; ++k) squares[k] = norm2(at(v[(k + 1) % 3]) - at(v[k]));
    return static_cast<std::size_t>(std::max_element(squares.begin(), squares.end()) - squares.begin());
  }

  double length_of(const Triangle& v) const {
    const std::size_t k = longest_edge(v);
    return norm(at(v[(k + 1) % 3]) - at(v[k]));
  }

  // Over the longest edge.
  double height_of(const Triangle& v) const {
    const double length = length_of(v);
    return length > 0 ? norm(normal_of(v)) / length : 0;
  }

  Vec3 normal_of(const Triangle& v) const { return twice_area_normal(at(v[0]), at(v[1]), at(v[2])); }

  bool is_lower(Index t, double height, double flat) const {
    const double is = height_of(mesh_.triangles[t]);
    return is < height && is < flat * length_of(mesh_.triangles[t]);
  }
  bool is_low(Index t) const { return is_lower(t, height_, kFlat); }
  bool is_low_for_a_fold(Index t) const { return is_lower(t, fold_, kFlatFold); }

  // The only other triangle of an edge, or kNone.
  Index across(Index t, Index a, Index b) const {
    Index beside = kNone;
    for (const Index u : at_[a]) {
      if (u == t || !has_corner(mesh_.triangles[u], b)) continue;
      if (beside != kNone) return kNone;
      beside = u;
    }
    return beside;
  }

  // Faces the other way than all neighbours, and lies on the one at its longest edge. Where two neighbours face the
  // same way it may be part of a sheet, whose edge is a crease.
  bool is_folded(Index t) const {
    const Triangle& v = mesh_.triangles[t];
    const std::size_t longest = longest_edge(v);
    const Vec3 n = normal_of(v);
    for (std::size_t k = 0; k < 3; ++k) {
      const Index beside = across(t, v[k], v[(k + 1) % 3]);
      if (beside == kNone) return false;
      const Vec3 m = normal_of(mesh_.triangles[beside]);
      if (!(dot(n, m) < (k == longest ? kFolded : 0) * norm(n) * norm(m))) return false;
    }
    return true;
  }

  void push_if_low(Index t) {
    if (is_low(t) || (is_low_for_a_fold(t) && is_folded(t))) queue_.push({height_of(mesh_.triangles[t]), t});
  }

  bool flip(Index cap) {
    const Triangle low = mesh_.triangles[cap];
    const std::size_t k = longest_edge(low);
    const Index a = low[k], b = low[(k + 1) % 3], apex = low[(k + 2) % 3];
    if (a == b || b == apex || apex == a || stays_.contains(edge_key(a, b))) return false;
    const Index beside = across(cap, a, b);
    if (beside == kNone) return false;
    const Triangle over = mesh_.triangles[beside];
    const Index other = over[0] + over[1] + over[2] - a - b;
    if (other == apex || shares_edge(apex, other)) return false;
    Triangle first = over, second = over;
    std::replace(first.begin(), first.end(), b, apex);
    std::replace(second.begin(), second.end(), a, apex);
    const Vec3 up = normal_of(over);
    if (!(dot(normal_of(first), up) > 0 && dot(normal_of(second), up) > 0)) return false;
    // So that this comes to an end.
    if (!(std::min(height_of(first), height_of(second)) > height_of(low))) return false;
    mesh_.triangles[cap] = first;
    mesh_.triangles[beside] = second;
    std::erase(at_[b], cap);
    std::erase(at_[a], beside);
    at_[other].push_back(cap);
    at_[apex].push_back(beside);
    if (!mesh_.face_of_triangle.empty()) mesh_.face_of_triangle[cap] = mesh_.face_of_triangle[beside];
    if (!mesh_.labels.empty()) mesh_.labels[cap] = mesh_.labels[beside];
    // What was in the way of others around may be gone.
    for (const Index v : {a, b, apex, other})
      for (const Index t : at_[v]) push_if_low(t);
    return true;
  }

  bool shares_edge(Index v, Index w) const {
    return std::any_of(at_[v].begin(), at_[v].end(), [&](Index t) { return has_corner(mesh_.triangles[t], w); });
  }

  TriangleMesh& mesh_;
  const double height_, fold_;
  std::priority_queue<Low, std::vector<Low>, std::greater<>> queue_;
  std::unordered_set<std::uint64_t> stays_;
  std::vector<std::vector<Index>> at_;  // triangles of each vertex
};

}  // namespace

std::size_t flip_caps(TriangleMesh& mesh, double height, double fold, const std::vector<std::array<Index, 2>>& given) {
  return CapFlips(mesh, height, fold, given).run();
}

}  // namespace bisector
