#include "remesh/flip_crossings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "mesh/topology.h"
#include "mesh/triangle_quality.h"

namespace bisector {
namespace {

using Edge = std::array<Index, 2>;

constexpr double kGoodAngle = 25;  // degrees
constexpr int kPasses = 3;

Vec3 normal_of(const TriangleMesh& mesh, const Triangle& t) {
  return twice_area_normal(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
}

class Flipper {
 public:
  explicit Flipper(TriangleMesh& mesh)
      : mesh_(mesh), component_(label_components(mesh.triangles, mesh.vertices.size())), locked_(mesh.feature_edges) {
    std::sort(locked_.begin(), locked_.end());
    double sum = 0;
    for (Index t = 0; t < mesh.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [edge, length] = side(mesh.triangles[t], k);
        at_[edge].push_back(t);
        sum += length;
      }
    cell_ = sum / static_cast<double>(3 * mesh.triangles.size());
    for (Index t = 0; t < mesh.triangles.size(); ++t) enter(t);
  }

  // True if any edge was flipped.
  bool run() {
    bool flipped = false;
    for (const auto& pair : find_self_intersections(mesh_)) {
      if (component_[mesh_.triangles[pair[0]][0]] == component_[mesh_.triangles[pair[1]][0]]) continue;
      std::optional<Flip> best;
      for (const Index t : pair)
        for (std::size_t k = 0; k < 3; ++k)
          if (const std::optional<Flip> flip = flip_at(t, k); flip && (!best || flip->rank > best->rank)) best = flip;
      if (!best) continue;
      apply(*best);
      flipped = true;
    }
    return flipped;
  }

 private:
  struct Flip {
    std::array<Index, 2> triangles;
    std::array<Triangle, 2> as;
    std::pair<std::ptrdiff_t, double> rank;  // pairs that no longer cross, and the least angle
  };
  using Cell = std::array<std::int64_t, 3>;
  struct HashOfCell {
    std::size_t operator()(const Cell& c) const {
      return static_cast<std::size_t>(c[0] * 73856093 ^ c[1] * 19349663 ^ c[2] * 83492791);
    }
  };

  std::pair<Edge, double> side(const Triangle& t, std::size_t k) const {
    const Index a = t[k], b = t[(k + 1) % 3];
    return {sorted_edge(a, b), norm(mesh_.vertices[b] - mesh_.vertices[a])};
  }

  template <class Visit>
  void each_cell(const Box& box, const Visit& visit) const {
    const auto at = [&](double x) { return static_cast<std::int64_t>(std::floor(x / cell_)); };
    for (std::int64_t x = at(box.lo.x); x <= at(box.hi.x); ++x)
      for (std::int64_t y = at(box.lo.y); y <= at(box.hi.y); ++y)
        for (std::int64_t z = at(box.lo.z); z <= at(box.hi.z); ++z) visit(Cell{x, y, z});
  }

  Box box_of(const std::vector<Triangle>& triangles) const { return bounding_box(mesh_.vertices, triangles); }

  void enter(Index t) {
    each_cell(box_of({mesh_.triangles[t]}), [&](const Cell& cell) { in_cell_[cell].push_back(t); });
  }

  // Pairs that cross of two triangles among themselves and with those of `near`.
  std::size_t crossings(const std::array<Triangle, 2>& two, const std::vector<Index>& near) const {
    TriangleMesh part;
    std::map<Index, Index> vertex;
    const auto add = [&](Triangle t) {
      for (Index& v : t) {
        const auto [at, is_new] = vertex.try_emplace(v, static_cast<Index>(part.vertices.size()));
        if (is_new) part.vertices.push_back(mesh_.vertices[v]);
        v = at->second;
      }
      part.triangles.push_back(t);
    };
    for (const Triangle& t : two) add(t);
    for (const Index t : near) add(mesh_.triangles[t]);
    std::size_t count = 0;
    for (const auto& pair : find_self_intersections(part)) count += pair[0] < 2;
    return count;
  }

  std::optional<Flip> flip_at(Index t, std::size_t k) const {
    const Triangle& v = mesh_.triangles[t];
    const Index a = v[k], b = v[(k + 1) % 3], c = v[(k + 2) % 3];
    const Edge edge = sorted_edge(a, b);
    const std::vector<Index>& beside = at_.at(edge);
    if (beside.size() != 2 || std::binary_search(locked_.begin(), locked_.end(), edge)) return std::nullopt;
    const Index u = beside[0] == t ? beside[1] : beside[0];
    if (!mesh_.labels.empty() && mesh_.labels[t] != mesh_.labels[u]) return std::nullopt;
    const Triangle& w = mesh_.triangles[u];
    const auto j = static_cast<std::size_t>(std::find(w.begin(), w.end(), b) - w.begin());
    if (w[(j + 1) % 3] != a) return std::nullopt;
    const Index d = w[(j + 2) % 3];
    if (c == d || (at_.contains(sorted_edge(c, d)) && !at_.at(sorted_edge(c, d)).empty())) return std::nullopt;
    Flip flip{{t, u}, {{{c, d, b}, {d, c, a}}}, {}};
    const Vec3 up = normal_of(mesh_, v) + normal_of(mesh_, w);
    const double before = std::min(least_angle(mesh_, v), least_angle(mesh_, w));
    const double after = std::min(least_angle(mesh_, flip.as[0]), least_angle(mesh_, flip.as[1]));
    if (after < std::min(kGoodAngle, before)) return std::nullopt;
    for (const Triangle& part : flip.as)
      if (dot(normal_of(mesh_, part), up) <= 0) return std::nullopt;
    std::vector<Index> near;
    each_cell(box_of({v, w}), [&](const Cell& cell) {
      if (const auto at = in_cell_.find(cell); at != in_cell_.end())
        near.insert(near.end(), at->second.begin(), at->second.end());
    });
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    std::erase_if(near, [&](Index n) { return n == t || n == u; });
    flip.rank = {
        static_cast<std::ptrdiff_t>(crossings({v, w}, near)) - static_cast<std::ptrdiff_t>(crossings(flip.as, near)),
        after};
    if (flip.rank.first <= 0) return std::nullopt;
    return flip;
  }

  void apply(const Flip& flip) {
    for (const Index t : flip.triangles)
      for (std::size_t k = 0; k < 3; ++k) std::erase(at_[side(mesh_.triangles[t], k).first], t);
    for (std::size_t i = 0; i < 2; ++i) {
      const Index t = flip.triangles[i];
      mesh_.triangles[t] = flip.as[i];
      for (std::size_t k = 0; k < 3; ++k) at_[side(mesh_.triangles[t], k).first].push_back(t);
      enter(t);
    }
  }

  TriangleMesh& mesh_;
  const std::vector<Index> component_;
  std::vector<Edge> locked_;
  std::map<Edge, std::vector<Index>> at_;  // triangles at an edge
  double cell_ = 0;
  std::unordered_map<Cell, std::vector<Index>, HashOfCell> in_cell_;  // triangles, perhaps as they were
};

}  // namespace

void flip_where_components_cross(TriangleMesh& mesh) {
  Flipper flipper(mesh);
  for (int pass = 0; pass < kPasses && flipper.run(); ++pass) {
  }
}

}  // namespace bisector
