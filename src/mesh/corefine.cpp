#include "mesh/corefine.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "mesh/topology.h"
#include "mesh/triangle_quality.h"

namespace bisector {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Delaunay = CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Default, CGAL::Exact_intersections_tag>;
using Point = Kernel::Point_3;
using Edge = std::array<Index, 2>;

Point exact(const Vec3& p) { return {p.x, p.y, p.z}; }

// The value of the number itself, not of the interval that it is known by: equal numbers are rounded alike.
double rounded(const Kernel::FT& x) { return CGAL::to_double(CGAL::exact(x)); }
Vec3 rounded(const Point& p) { return {rounded(p.x()), rounded(p.y()), rounded(p.z())}; }

// The plane of a triangle along one axis, and back.
class Projection {
 public:
  explicit Projection(const std::array<Point, 3>& corners) : origin_(corners[0]) {
    const auto normal = CGAL::cross_product(corners[1] - corners[0], corners[2] - corners[0]);
    for (int k = 1; k < 3; ++k)
      if (std::abs(CGAL::to_double(normal[k])) > std::abs(CGAL::to_double(normal[axis_]))) axis_ = k;
    for (int k = 0; k < 3; ++k) slope_[k] = k == axis_ ? Kernel::FT(0) : -normal[k] / normal[axis_];
    turned_ = normal[axis_] < 0;
  }

  Kernel::Point_2 operator()(const Point& p) const { return {p[(axis_ + 1) % 3], p[(axis_ + 2) % 3]}; }
  Point back(const Kernel::Point_2& p) const {
    std::array<Kernel::FT, 3> x;
    const int i = (axis_ + 1) % 3, j = (axis_ + 2) % 3;
    x[i] = p.x();
    x[j] = p.y();
    x[axis_] = origin_[axis_] + slope_[i] * (p.x() - origin_[i]) + slope_[j] * (p.y() - origin_[j]);
    return {x[0], x[1], x[2]};
  }
  // Whether triangles run the other way round in the projection.
  bool turned() const { return turned_; }

 private:
  Point origin_;
  int axis_ = 0;
  std::array<Kernel::FT, 3> slope_;
  bool turned_ = false;
};

class Corefiner {
 public:
  Corefiner(const TriangleMesh& mesh, std::vector<Index> component)
      : input_(mesh), component_(std::move(component)), cuts_(mesh.triangles.size()) {}

  // Points at corners of this triangle are these corners, on other triangles of the component as well.
  void share_corners(Index t) {
    for (const Index v : input_.triangles[t]) vertex_at_.try_emplace(key(component_[v], input_.vertices[v]), v);
  }

  // What two triangles have in common.
  void add(Index s, Index t) {
    const std::array<Point, 3> a = corners_of(s), b = corners_of(t);
    const auto common = CGAL::intersection(Kernel::Triangle_3(a[0], a[1], a[2]), Kernel::Triangle_3(b[0], b[1], b[2]));
    if (!common) return;
    if (const Point* p = boost::get<Point>(&*common)) found_.push_back({{s, t}, {*p, *p}});
    else if (const Kernel::Segment_3* segment = boost::get<Kernel::Segment_3>(&*common))
      found_.push_back({{s, t}, {segment->source(), segment->target()}});
    else if (const std::array<Index, 2> components = components_of({s, t}); components[0] != components[1])
      overlapping_.insert(components);
  }

  Corefinement run() {
    result_.mesh = input_;
    result_.mesh.triangles.clear();
    result_.mesh.labels.clear();
    result_.mesh.face_of_triangle.clear();
    for (const auto& [pair, cut] : found_) {
      if (overlapping_.contains(components_of(pair))) continue;
      for (const Index t : pair) {
        cuts_[t].push_back(cut);
        for (const Point& p : cut) put_on_edge(t, corners_of(t), p);
      }
    }
    for (Index t = 0; t < cuts_.size(); ++t)
      if (cuts_[t].empty() && !has_points(t)) take(t, input_.triangles[t]);
      else divide(t);
    for (const auto& [edge, points] : on_edge_) add_splits(edge);
    std::sort(result_.splits.begin(), result_.splits.end());
    result_.overlapping.assign(overlapping_.begin(), overlapping_.end());
    return std::move(result_);
  }

 private:
  using Cut = std::array<Point, 2>;
  using Key = std::tuple<Index, double, double, double>;

  static Key key(Index component, const Vec3& p) { return {component, p.x, p.y, p.z}; }

  std::array<Index, 2> components_of(const std::array<Index, 2>& pair) const {
    return sorted_edge(component_[input_.triangles[pair[0]][0]], component_[input_.triangles[pair[1]][0]]);
  }

  std::array<Point, 3> corners_of(Index t) const {
    const auto [a, b, c] = input_.triangles[t];
    return {exact(input_.vertices[a]), exact(input_.vertices[b]), exact(input_.vertices[c])};
  }

  void put_on_edge(Index t, const std::array<Point, 3>& corners, const Point& p) {
    for (std::size_t k = 0; k < 3; ++k)
      if (corners[k] == p) return;
    for (std::size_t k = 0; k < 3; ++k)
      if (Kernel::Segment_3(corners[k], corners[(k + 1) % 3]).has_on(p)) {
        on_edge_[sorted_edge(input_.triangles[t][k], input_.triangles[t][(k + 1) % 3])].push_back(p);
        return;
      }
  }

  bool has_points(Index t) const {
    const Triangle& v = input_.triangles[t];
    for (std::size_t k = 0; k < 3; ++k)
      if (on_edge_.contains(sorted_edge(v[k], v[(k + 1) % 3]))) return true;
    return false;
  }

  void take(Index t, const Triangle& part) {
    result_.mesh.triangles.push_back(part);
    result_.mesh.face_of_triangle.push_back(input_.face_of_triangle.empty() ? t : Index{input_.face_of_triangle[t]});
    if (!input_.labels.empty()) result_.mesh.labels.push_back(std::int32_t{input_.labels[t]});
  }

  void divide(Index t) {
    const Triangle& v = input_.triangles[t];
    const std::array<Point, 3> corners = corners_of(t);
    if (CGAL::collinear(corners[0], corners[1], corners[2])) return take(t, v);
    const Projection flat(corners);
    Delaunay parts;
    std::map<Delaunay::Vertex_handle, Index> index;
    for (std::size_t k = 0; k < 3; ++k) index[parts.insert(flat(corners[k]))] = v[k];
    for (std::size_t k = 0; k < 3; ++k)
      if (const auto points = on_edge_.find(sorted_edge(v[k], v[(k + 1) % 3])); points != on_edge_.end())
        for (const Point& p : points->second) parts.insert(flat(p));
    for (const auto& [from, to] : cuts_[t]) {
      const Delaunay::Vertex_handle a = parts.insert(flat(from)), b = parts.insert(flat(to));
      if (a != b) parts.insert_constraint(a, b);
    }
    // Those where two segments cross are among them.
    for (const auto at : parts.finite_vertex_handles())
      if (!index.contains(at)) index[at] = vertex_at(t, rounded(flat.back(at->point())));
    for (const auto face : parts.finite_face_handles()) {
      Triangle part{index[face->vertex(0)], index[face->vertex(1)], index[face->vertex(2)]};
      if (part[0] == part[1] || part[1] == part[2] || part[2] == part[0]) continue;
      if (flat.turned()) std::swap(part[1], part[2]);
      take(t, part);
    }
  }

  Index vertex_at(Index t, const Vec3& p) {
    const Triangle& v = input_.triangles[t];
    for (const Index corner : v)
      if (input_.vertices[corner] == p) return corner;
    const auto [at, is_new] =
        vertex_at_.try_emplace(key(component_[v[0]], p), static_cast<Index>(result_.mesh.vertices.size()));
    if (is_new) {
      result_.mesh.vertices.push_back(p);
      const auto [a, b, c] = v;
      result_.inserted.push_back(
          {t, barycentric_weights(input_.vertices[a], input_.vertices[b], input_.vertices[c], p)});
    }
    return at->second;
  }

  // From the lower end on, each point divides what is left of the edge.
  void add_splits(const Edge& edge) {
    std::vector<Point>& points = on_edge_[edge];
    const Point from = exact(input_.vertices[edge[0]]);
    std::sort(points.begin(), points.end(),
              [&](const Point& a, const Point& b) { return CGAL::has_smaller_distance_to_point(from, a, b); });
    Index last = edge[0];
    for (const Point& p : points) {
      const auto found = vertex_at_.find(key(component_[edge[0]], rounded(p)));
      if (found == vertex_at_.end() || found->second == last) continue;
      const Edge rest = sorted_edge(last, edge[1]);
      result_.splits.push_back({rest[0], rest[1], found->second});
      last = found->second;
    }
  }

  const TriangleMesh& input_;
  const std::vector<Index> component_;
  std::vector<std::pair<std::array<Index, 2>, Cut>> found_;
  std::set<std::array<Index, 2>> overlapping_;  // components
  std::vector<std::vector<Cut>> cuts_;          // of each triangle
  std::map<Edge, std::vector<Point>> on_edge_;  // between its ends
  std::map<Key, Index> vertex_at_;              // of each component
  Corefinement result_;
};

// Of the pairs of triangles that intersect, those of one component, or those of different ones.
std::optional<Corefinement> corefine(const TriangleMesh& mesh, bool of_one_component, std::size_t most_pairs) {
  std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  std::vector<std::array<Index, 2>> pairs = find_self_intersections(mesh);
  std::erase_if(pairs, [&](const std::array<Index, 2>& pair) {
    return of_one_component != (component[mesh.triangles[pair[0]][0]] == component[mesh.triangles[pair[1]][0]]);
  });
  if (pairs.empty() || pairs.size() > most_pairs) return std::nullopt;
  Corefiner corefiner(mesh, std::move(component));
  for (const auto& pair : pairs)
    for (const Index t : pair)
      if (of_one_component) corefiner.share_corners(t);
  for (const auto& [s, t] : pairs) corefiner.add(s, t);
  return corefiner.run();
}

}  // namespace

std::optional<Corefinement> corefine_components(const TriangleMesh& mesh, std::size_t most_pairs) {
  return corefine(mesh, false, most_pairs);
}

std::optional<Corefinement> corefine_sheets(const TriangleMesh& mesh, std::size_t most_pairs) {
  return corefine(mesh, true, most_pairs);
}

CommonParts find_common_parts(const TriangleMesh& mesh, const std::vector<std::array<Index, 2>>& overlapping) {
  const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  std::vector<Index> order;
  for (Index v = 0; v < component.size(); ++v)
    if (component[v] != kNone) order.push_back(v);
  const auto key = [&](Index v) {
    const Vec3& p = mesh.vertices[v];
    return std::tuple(p.x, p.y, p.z);
  };
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return key(a) < key(b); });
  CommonParts common;
  common.same.assign(mesh.vertices.size(), kNone);
  for (std::size_t first = 0, last = 0; first < order.size(); first = last) {
    bool several = false;
    for (; last < order.size() && key(order[last]) == key(order[first]); ++last)
      several |= component[order[last]] != component[order[first]];
    for (std::size_t k = first; several && k < last; ++k) common.same[order[k]] = order[first];
  }
  // Components at a triangle or edge of common vertices.
  std::map<Triangle, std::vector<Index>> at_triangle;
  const auto common_triangle = [&](const Triangle& t) {
    Triangle v{common.same[t[0]], common.same[t[1]], common.same[t[2]]};
    std::sort(v.begin(), v.end());
    return v;
  };
  for (const Triangle& t : mesh.triangles)
    if (const Triangle v = common_triangle(t); v[2] != kNone) at_triangle[v].push_back(component[t[0]]);
  struct Sides {
    std::vector<Index> components;
    bool parts = false;  // one of them has a triangle of its own here
  };
  std::map<Edge, Sides> at_edge;
  for (const Triangle& t : mesh.triangles) {
    const auto both = at_triangle.find(common_triangle(t));
    const bool own = both == at_triangle.end() || std::all_of(both->second.begin(), both->second.end(),
                                                              [&](Index c) { return c == component[t[0]]; });
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge edge = sorted_edge(common.same[t[k]], common.same[t[(k + 1) % 3]]);
      if (edge[1] == kNone) continue;
      Sides& sides = at_edge[edge];
      sides.components.push_back(component[t[0]]);
      sides.parts |= own;
    }
  }
  for (auto& [edge, sides] : at_edge) {
    std::vector<Index>& of = sides.components;
    std::sort(of.begin(), of.end());
    of.erase(std::unique(of.begin(), of.end()), of.end());
    bool meets = false;
    for (std::size_t i = 0; i < of.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        meets |= !std::binary_search(overlapping.begin(), overlapping.end(), std::array<Index, 2>{of[j], of[i]});
    if (sides.parts && meets) common.edges.push_back(edge);
  }
  return common;
}

}  // namespace bisector
