#include "bisector/repair.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <tuple>
#include <utility>

#include "bisector/error.h"
#include "core/geometry.h"
#include "core/grouping.h"
#include "mesh/joining.h"
#include "mesh/topology.h"
#include "mesh/triangle_quality.h"
#include "spatial/hilbert.h"
#include "spatial/seed_tree.h"

namespace bisector {

namespace {

using Edge = std::array<Index, 2>;

// For triangles of the same corners.
bool goes_the_same_way_round(const Triangle& a, const Triangle& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (a[0] == b[k]) return a[1] == b[(k + 1) % 3];
  return false;
}

bool has_repeated_corner(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

std::vector<Index> own_names(std::size_t vertices) {
  std::vector<Index> names(vertices);
  std::iota(names.begin(), names.end(), Index{0});
  return names;
}

// The mesh under work: its triangles and where each came from.
struct Work {
  const std::vector<Vec3>& points;
  const std::vector<std::int32_t>& labels;  // of the triangles of the input, or none
  std::vector<Triangle> triangles;
  std::vector<Index> origin;

  explicit Work(const TriangleMesh& mesh)
      : points(mesh.vertices), labels(mesh.labels), triangles(mesh.triangles), origin(mesh.triangles.size()) {
    std::iota(origin.begin(), origin.end(), Index{0});
  }

  // Returns how many were removed.
  std::size_t remove(const std::vector<char>& unwanted) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      if (unwanted[t]) continue;
      triangles[kept] = triangles[t];
      origin[kept++] = origin[t];
    }
    const std::size_t removed = triangles.size() - kept;
    triangles.resize(kept);
    origin.resize(kept);
    return removed;
  }

  std::size_t remove_degenerate() {
    std::vector<char> unwanted(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) unwanted[t] = has_repeated_corner(triangles[t]);
    return remove(unwanted);
  }

  // Of triangles with different labels those of the lowest stay: the sides of a sheet often have a label each, and one
  // of them is to be all over it. Of a fold nothing stays.
  std::size_t remove_duplicates() {
    struct Key {
      Triangle corners;
      std::int32_t label;
      std::size_t triangle;
    };
    std::vector<Key> keys(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      keys[t] = {triangles[t], labels.empty() ? 0 : labels[origin[t]], t};
      std::sort(keys[t].corners.begin(), keys[t].corners.end());
    }
    std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
      return std::tie(a.corners, a.label, a.triangle) < std::tie(b.corners, b.label, b.triangle);
    });
    std::vector<char> unwanted(triangles.size(), 0);
    std::vector<std::array<std::size_t, 2>> pairs;
    for (std::size_t k = 1; k < keys.size(); ++k) {
      if (keys[k].corners != keys[k - 1].corners) continue;
      unwanted[keys[k].triangle] = 1;
      if (keys[k].label == keys[k - 1].label) pairs.push_back({keys[k - 1].triangle, keys[k].triangle});
    }
    if (!pairs.empty()) mark_folds(pairs, unwanted);
    return remove(unwanted);
  }

  // Where a surface is folded onto itself along an edge of a triangle, a triangle of no thickness sticks out of it:
  // there it is closed without either side, and has border and non-manifold edges with one. A sheet that is written for
  // both sides is larger, or hangs together with one side of others. What is lower than coordinates are rounded is no
  // sheet anywhere.
  void mark_folds(const std::vector<std::array<std::size_t, 2>>& pairs, std::vector<char>& unwanted) const {
    const EdgeTable table = edge_table(triangles, points.size());
    std::vector<char> is_double = unwanted;
    for (const auto& [first, second] : pairs) is_double[first] = 1;
    const double rounding = kRounding * bounding_box(points, triangles).diagonal();
    for (const auto& [first, second] : pairs) {
      if (goes_the_same_way_round(triangles[first], triangles[second])) continue;
      const auto [a, b, c] = triangles[first];
      if (triangle_height(points[a], points[b], points[c]) < rounding) {
        unwanted[first] = 1;
        continue;
      }
      std::size_t folded = 0, closed = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Edge edge = sorted_edge(triangles[first][k], triangles[first][(k + 1) % 3]);
        const auto e = static_cast<std::size_t>(std::lower_bound(table.edges.begin(), table.edges.end(), edge) -
                                                table.edges.begin());
        const std::size_t uses = table.half_edges.size(e);
        folded += uses == 2;
        closed += uses == 4 && std::count_if(table.half_edges.begin(e), table.half_edges.end(e),
                                             [&](std::size_t h) { return is_double[h / 3]; }) == 2;
      }
      if (folded > 0 && closed > 0 && folded + closed == 3) unwanted[first] = 1;
    }
  }

  void rename(const std::vector<Index>& name) {
    for (Triangle& t : triangles)
      for (Index& v : t) v = name[v];
  }
};

std::size_t count_border(const EdgeTable& table) {
  std::size_t count = 0;
  for (std::size_t e = 0; e < table.edges.size(); ++e) count += table.half_edges.size(e) == 1;
  return count;
}

// The borders of a mesh, and what is near along the surface.
class Borders {
 public:
  Borders(const Work& work, double tolerance)
      : work_(work), tolerance_(tolerance), table(edge_table(work.triangles, work.points.size())),
        edge_of_(3 * work.triangles.size()),
        triangles_at_(items_at_vertices<std::size_t>(work.triangles, work.points.size())),
        stamp_(work.triangles.size(), 0) {
    std::vector<char> on_border(work.points.size(), 0);
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
      for (const std::size_t* h = table.half_edges.begin(e); h != table.half_edges.end(e); ++h) edge_of_[*h] = e;
      if (table.half_edges.size(e) != 1) continue;
      edges.push_back(e);
      for (const Index v : table.edges[e]) on_border[v] = 1;
    }
    for (std::size_t v = 0; v < on_border.size(); ++v)
      if (on_border[v]) vertices.push_back(static_cast<Index>(v));

    for (const Index v : vertices) ordered_points_.push_back(work.points[v]);
    for (const Index i : hilbert_order(ordered_points_)) ordered_.push_back(vertices[i]);
    for (std::size_t i = 0; i < ordered_.size(); ++i) ordered_points_[i] = work.points[ordered_[i]];
    tree_.build(ordered_points_);
  }
  Borders(const Borders&) = delete;
  Borders& operator=(const Borders&) = delete;

 private:
  const Work& work_;
  const double tolerance_;

 public:
  const EdgeTable table;
  std::vector<std::size_t> edges;  // of one triangle, ascending
  std::vector<Index> vertices;     // on them, ascending

  // Border vertices within the tolerance of a box, and some others, ascending.
  const std::vector<Index>& near(const Box& box) {
    found_.clear();
    tree_.near(box, tolerance_, found_);
    for (Index& i : found_) i = ordered_[i];
    std::sort(found_.begin(), found_.end());
    return found_;
  }

  // Marks the triangles that are joined to v through others, all of them within twice the tolerance of it.
  void mark_surface_around(Index v) {
    ++current_;
    front_.clear();
    const auto reach = [&](std::size_t t) {
      if (std::exchange(stamp_[t], current_) != current_) front_.push_back(t);
    };
    for (const std::size_t* t = triangles_at_.begin(v); t != triangles_at_.end(v); ++t) reach(*t);
    for (std::size_t i = 0; i < front_.size(); ++i)
      for (std::size_t h = 3 * front_[i]; h < 3 * front_[i] + 3; ++h) {
        const std::size_t e = edge_of_[h];
        for (const std::size_t* other = table.half_edges.begin(e); other != table.half_edges.end(e); ++other)
          if (stamp_[*other / 3] != current_ && distance(v, *other / 3) <= 2 * tolerance_) reach(*other / 3);
      }
  }
  bool is_marked(std::size_t triangle) const { return stamp_[triangle] == current_; }
  bool touches_marked(Index v) const {
    return std::any_of(triangles_at_.begin(v), triangles_at_.end(v), [&](std::size_t t) { return is_marked(t); });
  }

 private:
  double distance(Index v, std::size_t triangle) const {
    const auto [a, b, c] = work_.triangles[triangle];
    const Vec3& p = work_.points[v];
    return norm(p - nearest_on_triangle(p, work_.points[a], work_.points[b], work_.points[c]));
  }

  std::vector<std::size_t> edge_of_;  // of each half-edge
  Csr<std::size_t> triangles_at_;     // of each vertex
  std::vector<std::size_t> stamp_, front_;
  std::size_t current_ = 0;
  std::vector<Index> ordered_, found_;
  std::vector<Vec3> ordered_points_;
  SeedTree tree_;
};

// For each vertex the one that it becomes.
std::vector<Index> merge_borders(const Work& work, double tolerance) {
  Borders borders(work, tolerance);
  std::vector<Index> name = own_names(work.points.size()), next_member(work.points.size(), kNone);
  std::vector<std::pair<double, Index>> choices;
  for (const Index v : borders.vertices) {
    const Vec3& p = work.points[v];
    choices.clear();
    for (const Index w : borders.near({p, p})) {
      const double d = norm(work.points[w] - p);
      if (w < v && name[w] == w && d <= tolerance) choices.emplace_back(d, w);
    }
    if (choices.empty()) continue;
    std::sort(choices.begin(), choices.end());
    borders.mark_surface_around(v);
    for (const auto& [d, w] : choices) {
      Index last = w;
      bool apart = !borders.touches_marked(w);
      while (apart && next_member[last] != kNone) {
        last = next_member[last];
        apart = !borders.touches_marked(last);
      }
      if (!apart) continue;
      name[v] = w;
      next_member[last] = v;
      break;
    }
  }
  return name;
}

// Vertices to be put on an edge, in order from its lower end.
struct Inserted {
  Edge edge;
  std::vector<Index> vertices;
};

class EdgeSplitter {
 public:
  EdgeSplitter(Work& work, double tolerance) : work_(work), tolerance_(tolerance), borders_(work, tolerance) {
    neighbours_.resize(work.points.size());
    for (const std::size_t e : borders_.edges) {
      const auto [a, b] = borders_.table.edges[e];
      neighbours_[a].push_back(b);
      neighbours_[b].push_back(a);
    }
  }

  // Ascending by edge.
  std::vector<Inserted> split() {
    std::vector<Inserted> all;
    for (const std::size_t e : borders_.edges) {
      Inserted inserted{borders_.table.edges[e], find(e)};
      if (!inserted.vertices.empty()) all.push_back(std::move(inserted));
    }
    if (all.empty()) return all;
    std::vector<Triangle> triangles;
    std::vector<Index> origin;
    for (std::size_t t = 0; t < work_.triangles.size(); ++t) {
      emit(work_.triangles[t], 0, all, triangles);
      origin.resize(triangles.size(), work_.origin[t]);
    }
    work_.triangles = std::move(triangles);
    work_.origin = std::move(origin);
    return all;
  }

 private:
  double parameter(Index v, Index a, Index b) const {
    const Vec3 d = work_.points[b] - work_.points[a];
    return dot(work_.points[v] - work_.points[a], d) / norm2(d);
  }
  double distance_to_edge(Index v, Index a, Index b) const {
    const double t = std::clamp(parameter(v, a, b), 0.0, 1.0);
    return norm(work_.points[v] - ((1 - t) * work_.points[a] + t * work_.points[b]));
  }

  std::vector<Index> find(std::size_t e) {
    const auto [a, b] = borders_.table.edges[e];
    const std::size_t half_edge = *borders_.table.half_edges.begin(e);
    const Index apex = work_.triangles[half_edge / 3][(half_edge + 2) % 3];
    std::vector<std::pair<double, Index>> on_edge;
    const std::vector<Index> near = borders_.near(bounding_box({work_.points[a], work_.points[b]}));
    for (const Index v : near) {
      if (v == a || v == b || v == apex || distance_to_edge(v, a, b) > tolerance_) continue;
      if (norm(work_.points[v] - work_.points[a]) <= tolerance_) continue;
      if (norm(work_.points[v] - work_.points[b]) <= tolerance_) continue;
      const bool along = std::any_of(neighbours_[v].begin(), neighbours_[v].end(), [&](Index w) {
        return distance_to_edge(w, a, b) <= tolerance_ || distance_to_edge(a, v, w) <= tolerance_ ||
               distance_to_edge(b, v, w) <= tolerance_;
      });
      if (!along) continue;
      borders_.mark_surface_around(v);
      if (!borders_.is_marked(half_edge / 3)) on_edge.emplace_back(parameter(v, a, b), v);
    }
    std::sort(on_edge.begin(), on_edge.end());
    std::vector<Index> vertices;
    for (const auto& [t, v] : on_edge) vertices.push_back(v);
    return turns_over(a, b, apex, vertices) ? std::vector<Index>{} : vertices;
  }

  bool turns_over(Index a, Index b, Index apex, const std::vector<Index>& vertices) const {
    const Vec3& c = work_.points[apex];
    const auto normal = [&](Index i, Index j) { return twice_area_normal(work_.points[i], work_.points[j], c); };
    const Vec3 whole = normal(a, b);
    Index last = a;
    for (std::size_t k = 0; k <= vertices.size(); ++k) {
      const Index next = k < vertices.size() ? vertices[k] : b;
      if (!(dot(normal(last, next), whole) > 0)) return true;
      last = next;
    }
    return false;
  }

  // Splits a triangle at the vertices put on its edges, one edge after the other from the given one on: the parts at an
  // edge make a fan around the corner opposite.
  static void emit(const Triangle& t, std::size_t edge, const std::vector<Inserted>& all, std::vector<Triangle>& out) {
    for (std::size_t k = edge; k < 3; ++k) {
      const Index a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      const Edge e{std::min(a, b), std::max(a, b)};
      const auto at = std::lower_bound(all.begin(), all.end(), e,
                                       [](const Inserted& i, const Edge& wanted) { return i.edge < wanted; });
      if (at == all.end() || at->edge != e) continue;
      std::vector<Index> chain = at->vertices;
      if (a > b) std::reverse(chain.begin(), chain.end());
      chain.insert(chain.begin(), a);
      chain.push_back(b);
      for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
        Triangle part;
        part[k] = chain[i];
        part[(k + 1) % 3] = chain[i + 1];
        part[(k + 2) % 3] = c;
        emit(part, k + 1, all, out);
      }
      return;
    }
    out.push_back(t);
  }

  Work& work_;
  const double tolerance_;
  Borders borders_;
  std::vector<std::vector<Index>> neighbours_;  // of each vertex along borders
};

std::vector<Edge> rename_feature_edges(const TriangleMesh& mesh, const std::vector<Index>& name,
                                       const std::vector<Inserted>& splits) {
  std::vector<Edge> edges;
  for (const Edge& old : mesh.feature_edges) {
    const Edge e{std::min(name[old[0]], name[old[1]]), std::max(name[old[0]], name[old[1]])};
    if (e[0] == e[1]) continue;
    const auto at = std::lower_bound(splits.begin(), splits.end(), e,
                                     [](const Inserted& i, const Edge& wanted) { return i.edge < wanted; });
    Index last = e[0];
    if (at != splits.end() && at->edge == e)
      for (const Index v : at->vertices) edges.push_back({std::exchange(last, v), v});
    edges.push_back({last, e[1]});
  }
  return edges;
}

// Sorts edges, each once, and drops those that collapsed with their triangles.
void keep_edges_of(const Work& work, std::vector<Edge>& edges) {
  if (edges.empty()) return;
  for (Edge& e : edges) std::sort(e.begin(), e.end());
  std::sort(edges.begin(), edges.end());
  const std::vector<Edge> known = edge_table(work.triangles, work.points.size()).edges;
  std::vector<Edge> kept;
  std::set_intersection(edges.begin(), edges.end(), known.begin(), known.end(), std::back_inserter(kept));
  edges = std::move(kept);
}

// The welded mesh. `name` tells for each vertex of the input which one it has become, and then the index of that one
// among those that are left.
TriangleMesh collect(const TriangleMesh& mesh, Work work, std::vector<Edge> feature_edges, std::vector<Index>& name) {
  TriangleMesh welded;
  std::vector<Index> place(mesh.vertices.size(), kNone);
  for (std::size_t v = 0; v < name.size(); ++v)
    if (name[v] == v) {
      place[v] = static_cast<Index>(welded.vertices.size());
      welded.vertices.push_back(mesh.vertices[v]);
    }
  for (Index& v : name) v = place[v];
  work.rename(place);
  for (Edge& e : feature_edges)
    for (Index& v : e) v = place[v];

  bool same_faces = work.origin.size() == mesh.triangles.size();
  for (std::size_t t = 0; same_faces && t < work.origin.size(); ++t) same_faces = work.origin[t] == t;
  for (const Index t : work.origin) {
    if (!mesh.labels.empty()) welded.labels.push_back(mesh.labels[t]);
    if (!mesh.face_of_triangle.empty()) welded.face_of_triangle.push_back(mesh.face_of_triangle[t]);
    else if (!same_faces) welded.face_of_triangle.push_back(t);
  }
  welded.triangles = std::move(work.triangles);
  welded.feature_edges = std::move(feature_edges);
  return welded;
}

}  // namespace

WeldResult remove_double_triangles(const TriangleMesh& mesh) {
  WeldResult result;
  Work work(mesh);
  result.border_before = count_border(edge_table(work.triangles, work.points.size()));
  result.duplicate_triangles = work.remove_duplicates();
  result.border_after = result.duplicate_triangles == 0 ? result.border_before
                                                        : count_border(edge_table(work.triangles, work.points.size()));
  result.vertex_of = own_names(mesh.vertices.size());
  std::vector<Edge> feature_edges = mesh.feature_edges;
  if (result.duplicate_triangles > 0) keep_edges_of(work, feature_edges);
  result.mesh = collect(mesh, std::move(work), std::move(feature_edges), result.vertex_of);
  return result;
}

bool joins_borders(const MeshTopology& now, const MeshTopology& before) {
  return now.boundary_edges <= before.boundary_edges &&
         now.boundary_edges + now.non_manifold_edges < before.boundary_edges + before.non_manifold_edges;
}

std::vector<Index> first_equal(const std::vector<Vec3>& points) {
  std::vector<Index> order(points.size()), first(points.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::sort(order.begin(), order.end(), [&](Index i, Index j) {
    const Vec3 &p = points[i], &q = points[j];
    if (p.x != q.x) return p.x < q.x;
    if (p.y != q.y) return p.y < q.y;
    return p.z != q.z ? p.z < q.z : i < j;
  });
  for (std::size_t k = 0; k < order.size(); ++k)
    first[order[k]] = k > 0 && points[order[k]] == points[order[k - 1]] ? first[order[k - 1]] : order[k];
  return first;
}

std::vector<Triangle> join_equal_points(const TriangleMesh& mesh) {
  const auto topology_of = [&](const std::vector<Triangle>& triangles) {
    return analyse_topology(triangles, mesh.vertices.size());
  };
  const MeshTopology before = topology_of(mesh.triangles);
  if (before.boundary_edges == 0) return mesh.triangles;
  const std::vector<Index> first = first_equal(mesh.vertices);
  std::vector<Triangle> joined = mesh.triangles;
  for (Triangle& t : joined)
    if (const Triangle named{first[t[0]], first[t[1]], first[t[2]]}; !has_repeated_corner(named)) t = named;
  return joins_borders(topology_of(joined), before) ? joined : mesh.triangles;
}

WeldResult weld(const TriangleMesh& mesh, double tolerance) {
  if (!(tolerance >= 0 && std::isfinite(tolerance)))
    throw Error(fmt::format("welding tolerance {}: give a length, 0 or more", tolerance));
  WeldResult result;
  Work work(mesh);
  result.degenerate_triangles = work.remove_degenerate();
  result.border_before = count_border(edge_table(work.triangles, work.points.size()));

  std::vector<Index> name = first_equal(mesh.vertices);
  const auto clean = [&] {
    result.degenerate_triangles += work.remove_degenerate();
    result.duplicate_triangles += work.remove_duplicates();
  };
  work.rename(name);
  clean();
  std::vector<Inserted> splits;
  if (tolerance > 0) {
    const std::vector<Index> merged = merge_borders(work, tolerance);
    for (Index& v : name) v = merged[v];
    work.rename(merged);
    clean();
    splits = EdgeSplitter(work, tolerance).split();
    result.split_edges = splits.size();
    clean();
  }
  std::vector<Edge> feature_edges = rename_feature_edges(mesh, name, splits);
  keep_edges_of(work, feature_edges);

  result.mesh = collect(mesh, std::move(work), std::move(feature_edges), name);
  result.merged_vertices = mesh.vertices.size() - result.mesh.vertices.size();
  result.border_after = count_border(edge_table(result.mesh.triangles, result.mesh.vertices.size()));
  result.vertex_of = std::move(name);
  return result;
}

}  // namespace bisector
