#include "mesh/short_edges.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <queue>
#include <tuple>
#include <unordered_set>
#include <utility>

#include "core/disjoint_sets.h"
#include "core/geometry.h"
#include "mesh/stars.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

class Collapse {
 public:
  Collapse(TriangleMesh& mesh, double length, const std::vector<std::array<Index, 2>>& given, double flat_part)
      : mesh_(mesh), length_(length), flat_part_(flat_part) {
    result_.vertex_of.resize(mesh.vertices.size());
    std::iota(result_.vertex_of.begin(), result_.vertex_of.end(), Index{0});
    for (const Triangle& t : mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k) push_if_short(t[k], t[(k + 1) % 3]);
    find_lines(given);
    gone_.assign(mesh.triangles.size(), 0);
    if (queue_.empty()) return;
    at_.resize(mesh.vertices.size());
    for (Index t = 0; t < mesh.triangles.size(); ++t)
      for (const Index v : mesh.triangles[t]) at_[v].push_back(t);
  }

  ShortEdges run() {
    while (!queue_.empty()) {
      const auto [length, a, b] = queue_.top();
      queue_.pop();
      if (result_.vertex_of[a] != a || result_.vertex_of[b] != b || !may_go(a, b)) continue;
      on_line_[b] && !on_line_[a] ? collapse(b, a) : collapse(a, b);
    }
    remove_small_parts();
    if (result_.collapsed + result_.removed_parts > 0) collect();
    return std::move(result_);
  }

 private:
  using Edge = std::tuple<double, Index, Index>;  // squared length, lower and higher end

  void push_if_short(Index a, Index b) {
    if (a == b) return;
    const double squared = norm2(mesh_.vertices[b] - mesh_.vertices[a]);
    if (squared < length_ * length_) queue_.push({squared, std::min(a, b), std::max(a, b)});
  }

  void find_lines(const std::vector<std::array<Index, 2>>& given) {
    const std::vector<std::int32_t>& labels = mesh_.labels;
    const EdgeTable table = edge_table(mesh_.triangles, mesh_.vertices.size());
    on_line_.assign(mesh_.vertices.size(), 0);
    const auto add = [&](const std::array<Index, 2>& e) {
      lines_.insert(edge_key(e[0], e[1]));
      on_line_[e[0]] = on_line_[e[1]] = 1;
    };
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
      const std::size_t* const sides = table.half_edges.begin(e);
      if (table.half_edges.size(e) != 2 || (!labels.empty() && labels[sides[0] / 3] != labels[sides[1] / 3]))
        add(table.edges[e]);
    }
    for (const auto& edge : given) add(edge);
    for (const auto& edge : mesh_.feature_edges) add(edge);
  }

  bool is_line(Index a, Index b) const { return lines_.contains(edge_key(a, b)); }

  std::vector<Index> neighbours(Index v) const { return neighbours_in_star(mesh_.triangles, at_[v], v); }

  bool may_go(Index a, Index b) const {
    std::vector<Index> opposite;
    for (const Index t : at_[a])
      if (has_corner(mesh_.triangles[t], b))
        for (const Index v : mesh_.triangles[t])
          if (v != a && v != b) opposite.push_back(v);
    if (opposite.empty() || opposite.size() > 2) return false;
    if (on_line_[a] && on_line_[b] && !is_line(a, b)) return false;
    for (const Index v : opposite)
      if (is_line(a, v) && is_line(b, v)) return false;
    std::sort(opposite.begin(), opposite.end());
    const std::vector<Index> of_a = neighbours(a), of_b = neighbours(b);
    std::vector<Index> common;
    std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::back_inserter(common));
    if (common != opposite) return false;
    // Nor may both ends have a triangle over the same edge, as those of a tetrahedron do.
    return std::none_of(at_[a].begin(), at_[a].end(), [&](Index t) {
      Triangle moved = mesh_.triangles[t];
      if (has_corner(moved, b)) return false;
      std::replace(moved.begin(), moved.end(), a, b);
      std::sort(moved.begin(), moved.end());
      return std::any_of(at_[b].begin(), at_[b].end(), [&](Index other) {
        Triangle there = mesh_.triangles[other];
        std::sort(there.begin(), there.end());
        return there == moved;
      });
    });
  }

  void collapse(Index stays, Index goes) {
    for (const Index v : neighbours(goes)) {
      if (lines_.erase(edge_key(goes, v)) == 0 || v == stays) continue;
      lines_.insert(edge_key(stays, v));
      on_line_[stays] = 1;
    }
    for (const Index t : at_[goes]) {
      Triangle& corners = mesh_.triangles[t];
      if (!has_corner(corners, stays)) {
        std::replace(corners.begin(), corners.end(), goes, stays);
        at_[stays].push_back(t);
        continue;
      }
      gone_[t] = 1;
      ++result_.removed_triangles;
      for (const Index v : corners)
        if (v != goes) std::erase(at_[v], t);
    }
    at_[goes].clear();
    result_.vertex_of[goes] = stays;
    ++result_.collapsed;
    // What was in the way of others around may be gone.
    for (const Index v : neighbours(stays))
      for (const Index w : neighbours(v)) push_if_short(v, w);
  }

  // Parts hang together through edges of two triangles; they may touch others elsewhere.
  void remove_small_parts() {
    std::vector<Index> left;
    std::vector<Triangle> triangles;
    for (Index t = 0; t < gone_.size(); ++t)
      if (!gone_[t]) {
        left.push_back(t);
        triangles.push_back(mesh_.triangles[t]);
      }
    const EdgeTable table = edge_table(triangles, mesh_.vertices.size());
    DisjointSets<Index> sets(left.size());
    for (std::size_t e = 0; e < table.edges.size(); ++e)
      if (const std::size_t* h = table.half_edges.begin(e); table.half_edges.size(e) == 2)
        sets.join(static_cast<Index>(h[0] / 3), static_cast<Index>(h[1] / 3));
    std::vector<std::vector<Triangle>> parts(left.size());  // by their first triangle
    for (Index k = 0; k < left.size(); ++k) parts[sets.root(k)].push_back(triangles[k]);
    std::vector<char> goes(left.size(), 0);
    bool all_go = true;
    for (Index k = 0; k < left.size(); ++k)
      if (sets.is_root(k)) all_go &= (goes[k] = is_small(parts[k])) != 0;
    if (all_go) return;
    is_removed_.assign(mesh_.vertices.size(), 0);
    for (Index k = 0; k < left.size(); ++k) {
      if (!goes[sets.root(k)]) continue;
      result_.removed_parts += sets.is_root(k);
      ++result_.removed_triangles;
      gone_[left[k]] = 1;
      for (const Index v : triangles[k]) is_removed_[v] = 1;
    }
    for (Index k = 0; k < left.size(); ++k)
      if (!gone_[left[k]])
        for (const Index v : triangles[k]) is_removed_[v] = 0;
  }

  // Not if there is a line at it.
  bool is_small(const std::vector<Triangle>& part) const {
    for (const Triangle& v : part)
      if (on_line_[v[0]] || on_line_[v[1]] || on_line_[v[2]]) return false;
    const double size = bounding_box(mesh_.vertices, part).diagonal();
    return size < length_ || (size < flat_part_ && is_flat(part));
  }

  // Whether no corner is farther than the length from the plane of the largest triangle.
  bool is_flat(const std::vector<Triangle>& triangles) const {
    const auto normal = [&](const Triangle& v) {
      return twice_area_normal(mesh_.vertices[v[0]], mesh_.vertices[v[1]], mesh_.vertices[v[2]]);
    };
    Triangle largest = triangles[0];
    for (const Triangle& v : triangles)
      if (norm2(normal(v)) > norm2(normal(largest))) largest = v;
    const Vec3 up = normal(largest), origin = mesh_.vertices[largest[0]];
    return std::all_of(triangles.begin(), triangles.end(), [&](const Triangle& v) {
      return std::all_of(v.begin(), v.end(), [&](Index corner) {
        return std::abs(dot(mesh_.vertices[corner] - origin, up)) <= length_ * norm(up);
      });
    });
  }

  // What is left of the mesh.
  void collect() {
    std::vector<Index>& became = result_.vertex_of;
    for (Index& v : became)
      while (became[v] != v) v = became[v];
    std::vector<Index> place(became.size(), kNone);
    Index vertices = 0;
    for (Index v = 0; v < became.size(); ++v) {
      if (became[v] != v || (!is_removed_.empty() && is_removed_[v])) continue;
      mesh_.vertices[vertices] = mesh_.vertices[v];
      place[v] = vertices++;
    }
    mesh_.vertices.resize(vertices);
    for (Index& v : became) v = place[v];
    if (mesh_.face_of_triangle.empty()) {
      mesh_.face_of_triangle.resize(mesh_.triangles.size());
      std::iota(mesh_.face_of_triangle.begin(), mesh_.face_of_triangle.end(), Index{0});
    }
    std::size_t left = 0;
    for (std::size_t t = 0; t < gone_.size(); ++t) {
      if (gone_[t]) continue;
      for (std::size_t k = 0; k < 3; ++k) mesh_.triangles[left][k] = place[mesh_.triangles[t][k]];
      if (!mesh_.labels.empty()) mesh_.labels[left] = mesh_.labels[t];
      mesh_.face_of_triangle[left++] = mesh_.face_of_triangle[t];
    }
    mesh_.triangles.resize(left);
    mesh_.face_of_triangle.resize(left);
    if (!mesh_.labels.empty()) mesh_.labels.resize(left);
    std::vector<std::array<Index, 2>> edges;
    for (const auto& [a, b] : mesh_.feature_edges)
      if (became[a] != became[b]) edges.push_back(sorted_edge(became[a], became[b]));
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    mesh_.feature_edges = std::move(edges);
  }

  TriangleMesh& mesh_;
  const double length_, flat_part_;
  std::priority_queue<Edge, std::vector<Edge>, std::greater<>> queue_;
  std::vector<std::vector<Index>> at_;       // triangles of each vertex
  std::unordered_set<std::uint64_t> lines_;  // edges that count as borders
  std::vector<char> on_line_, gone_, is_removed_;
  ShortEdges result_;
};

}  // namespace

ShortEdges collapse_short_edges(TriangleMesh& mesh, double length, const std::vector<std::array<Index, 2>>& given,
                                double flat_part) {
  return Collapse(mesh, length, given, flat_part).run();
}

}  // namespace bisector
