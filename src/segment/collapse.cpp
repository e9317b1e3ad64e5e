#include "segment/collapse.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <queue>
#include <tuple>
#include <utility>

#include "mesh/stars.h"

namespace bisector {
namespace {

class Collapser {
 public:
  Collapser(const std::vector<Vec3>& vertices, const std::vector<char>& kept, const std::vector<Vec3>& normals,
            LabelledTriangles& mesh)
      : vertices_(vertices), kept_(kept), normals_(normals), mesh_(mesh), at_vertex_(vertices.size()),
        alive_(mesh.triangles.size(), 1), sizes_(normals.size(), 0) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      ++sizes_[mesh.labels[t]];
      for (const Index v : mesh.triangles[t]) at_vertex_[v].push_back(static_cast<Index>(t));
    }
  }

  void run() {
    for (const bool keeps_sides : {true, false}) {
      for (std::size_t v = 0; v < vertices_.size(); ++v) put(static_cast<Index>(v), keeps_sides);
      while (!queue_.empty()) {
        const auto [length, v, u] = queue_.top();
        queue_.pop();
        // What changed about v since is in the queue anew.
        if (at_vertex_[v].empty() || best(v, keeps_sides) != std::pair{length, u}) continue;
        collapse(v, u);
        put(u, keeps_sides);
        for (const Index w : neighbours(u)) put(w, keeps_sides);
      }
    }
    remove_dead();
  }

 private:
  using Entry = std::tuple<double, Index, Index>;  // squared length, from, to

  std::vector<Index> neighbours(Index v) const { return neighbours_in_star(mesh_.triangles, at_vertex_[v], v); }

  std::array<Index, 2> triangles_at_edge(Index v, Index u) const {
    std::array<Index, 2> found{kNone, kNone};
    for (const Index t : at_vertex_[v])
      if (has_corner(mesh_.triangles[t], u)) found[found[0] != kNone] = t;
    return found;
  }

  bool is_border(const std::array<Index, 2>& sides) const {
    return sides[1] == kNone || mesh_.labels[sides[0]] != mesh_.labels[sides[1]];
  }

  void put(Index v, bool keeps_sides) {
    if (kept_[v] || at_vertex_[v].empty()) return;
    const auto [length, u] = best(v, keeps_sides);
    if (u != kNone) queue_.push({length, v, u});
  }

  // The shortest edge that may be collapsed, or kNone.
  std::pair<double, Index> best(Index v, bool keeps_sides) const {
    const std::vector<Index> ring = neighbours(v);
    std::vector<std::pair<double, Index>> candidates, along_border;
    for (const Index u : ring) {
      const std::pair candidate{norm2(vertices_[u] - vertices_[v]), u};
      candidates.push_back(candidate);
      if (is_border(triangles_at_edge(v, u))) along_border.push_back(candidate);
    }
    if (!along_border.empty()) candidates = std::move(along_border);
    std::sort(candidates.begin(), candidates.end());
    for (const auto& [length, u] : candidates)
      if (keeps_topology(v, u, ring) && (!keeps_sides || keeps_all_sides(v, u))) return {length, u};
    return {0, kNone};
  }

  bool keeps_topology(Index v, Index u, const std::vector<Index>& ring) const {
    const std::array<Index, 2> sides = triangles_at_edge(v, u);
    const std::size_t opposite = sides[1] == kNone ? 1 : 2;
    const std::vector<Index> other = neighbours(u);
    std::size_t common = 0;
    for (const Index w : ring) common += std::binary_search(other.begin(), other.end(), w);
    if (common != opposite) return false;
    for (const Index t : sides)
      if (t != kNone && sizes_[mesh_.labels[t]] == 1) return false;
    return sides[1] == kNone || mesh_.labels[sides[0]] != mesh_.labels[sides[1]] || sizes_[mesh_.labels[sides[0]]] > 2;
  }

  bool keeps_all_sides(Index v, Index u) const {
    for (const Index t : at_vertex_[v]) {
      if (has_corner(mesh_.triangles[t], u)) continue;
      std::array<Vec3, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        const Index w = mesh_.triangles[t][k];
        corners[k] = vertices_[w == v ? u : w];
      }
      if (!(dot(twice_area_normal(corners[0], corners[1], corners[2]), normals_[mesh_.labels[t]]) > 0)) return false;
    }
    return true;
  }

  void collapse(Index v, Index u) {
    for (const Index t : at_vertex_[v]) {
      if (has_corner(mesh_.triangles[t], u)) {
        alive_[t] = 0;
        --sizes_[mesh_.labels[t]];
        for (const Index w : mesh_.triangles[t])
          if (w != v) std::erase(at_vertex_[w], t);
      } else {
        for (Index& w : mesh_.triangles[t])
          if (w == v) w = u;
        at_vertex_[u].push_back(t);
      }
    }
    at_vertex_[v].clear();
  }

  void remove_dead() {
    LabelledTriangles left;
    for (std::size_t t = 0; t < alive_.size(); ++t) {
      if (!alive_[t]) continue;
      left.triangles.push_back(mesh_.triangles[t]);
      left.labels.push_back(mesh_.labels[t]);
    }
    mesh_ = std::move(left);
  }

  const std::vector<Vec3>& vertices_;
  const std::vector<char>& kept_;
  const std::vector<Vec3>& normals_;
  LabelledTriangles& mesh_;
  std::vector<std::vector<Index>> at_vertex_;  // triangles that are alive
  std::vector<char> alive_;
  std::vector<std::size_t> sizes_;  // triangles of each region
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
};

}  // namespace

void collapse_vertices(const std::vector<Vec3>& vertices, const std::vector<char>& kept,
                       const std::vector<Vec3>& normals, LabelledTriangles& mesh) {
  Collapser(vertices, kept, normals, mesh).run();
}

}  // namespace bisector
