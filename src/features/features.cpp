#include "bisector/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "bisector/error.h"
#include "core/degenerate.h"
#include "core/disjoint_sets.h"
#include "core/geometry.h"
#include "core/grouping.h"
#include "core/parallel.h"
#include "features/planar_reduction.h"
#include "mesh/topology.h"

namespace bisector {

namespace {

constexpr std::size_t kNoEdge = static_cast<std::size_t>(-1);

// --- how the surface folds at its edges ---

// An edge of a larger dihedral deviation may be a crease without the support of others, in radians.
constexpr double kSeedAngle = 40 * kRadiansPerDegree;
// A triangle with both a height below the first, in diagonals of the bounding box, and a height over longest edge below
// the second has no normal of its own: the rounding of a file's coordinates may have turned it.
constexpr double kSliverHeight = 1e-4;
constexpr double kSliverAspect = 0.02;
// Triangles without normal that are looked through, one after the other, before the search for a normal is given up.
constexpr std::size_t kMostSteps = 64;

// Angle between two directions that need not have unit length.
double angle_between(const Vec3& a, const Vec3& b) {
  const double m = norm(a), n = norm(b);
  if (!(m > 0 && n > 0)) return 0;
  const Vec3 u = (1 / m) * a, v = (1 / n) * b;  // lengths squared twice could leave the range
  return std::atan2(norm(cross(u, v)), dot(u, v));
}

class Folds {
 public:
  // Both must outlive the object; no triangle may have a repeated corner.
  Folds(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles)
      : points_(points), triangles_(triangles), table(edge_table(triangles, points.size())),
        edge_of_(3 * triangles.size()) {
    for (std::size_t e = 0; e < table.edges.size(); ++e)
      for (const std::size_t* h = table.half_edges.begin(e); h != table.half_edges.end(e); ++h) edge_of_[*h] = e;
    find_normals();
    angle.resize(table.edges.size());
    bend.resize(table.edges.size());
    beside.resize(table.edges.size(), {kNone, kNone});
    parallel_each(table.edges.size(), [&](std::size_t e) { measure(e); });
  }

 private:
  const std::vector<Vec3>& points_;
  const std::vector<Triangle>& triangles_;

 public:
  EdgeTable table;
  // Of each edge the two triangles that it lies between, seen through those without normal; else kNone, and angle 0.
  std::vector<std::array<Index, 2>> beside;
  std::vector<double> angle;  // between their normals, radians
  std::vector<double> bend;   // of the surface beside the edge, about the edge: the greater of both sides, radians

  const Vec3& point(Index v) const { return points_[v]; }
  // Of a triangle, with lengths multiplied by `scale`.
  double area(std::size_t t, double scale) const {
    const Triangle& v = triangles_[t];
    return 0.5 * norm(cross(scale * (point(v[1]) - point(v[0])), scale * (point(v[2]) - point(v[0]))));
  }
  double length(std::size_t e) const { return norm(point(table.edges[e][1]) - point(table.edges[e][0])); }
  std::size_t edge_of(std::size_t half_edge) const { return edge_of_[half_edge]; }

 private:
  // What lies across an edge, beyond triangles without normal.
  struct Side {
    std::size_t triangle = kNoEdge;
    std::size_t edge = kNoEdge;  // by which it was entered
    bool flipped = false;        // against the triangle that was left
  };

  bool has_normal(std::size_t triangle) const { return !(normals_[triangle] == Vec3{}); }

  void find_normals() {
    const double diagonal = bounding_box(points_, triangles_).diagonal();
    normals_.resize(triangles_.size());
    parallel_each(triangles_.size(), [&](std::size_t t) {
      const auto [a, b, c] = triangles_[t];
      const Vec3 p = point(b) - point(a), q = point(c) - point(a);
      const double longest = std::sqrt(std::max({norm2(p), norm2(q), norm2(p - q)}));
      if (!(longest > 0)) return;
      const Vec3 n = cross((1 / longest) * p, (1 / longest) * q);
      const double aspect = norm(n);
      const bool sliver = aspect < kSliverAspect && aspect * longest < kSliverHeight * diagonal;
      if (!sliver && std::isnormal(aspect) && !collinear(point(a), point(b), point(c))) normals_[t] = (1 / aspect) * n;
    });
  }

  Index start_of(std::size_t half_edge) const { return triangles_[half_edge / 3][half_edge % 3]; }

  // From a half-edge's triangle across that edge of two triangles.
  Side cross_edge(std::size_t half_edge) const {
    Side side;
    std::size_t edge = edge_of_[half_edge];
    const Vec3 middle = 0.5 * (point(table.edges[edge][0]) + point(table.edges[edge][1]));
    for (std::size_t step = 0; step <= kMostSteps; ++step) {
      if (table.half_edges.size(edge) != 2) return {};
      const std::size_t* sides = table.half_edges.begin(edge);
      const std::size_t other = sides[0] == half_edge ? sides[1] : sides[0];
      if (start_of(half_edge) == start_of(other)) side.flipped = !side.flipped;
      if (other / 3 == half_edge / 3) return {};
      if (has_normal(other / 3)) {
        side.triangle = other / 3;
        side.edge = edge;
        return side;
      }
      const std::size_t base = other - other % 3;
      const std::size_t first = base + (other + 1) % 3, second = base + (other + 2) % 3;
      half_edge = distance_to(middle, first) <= distance_to(middle, second) ? first : second;
      edge = edge_of_[half_edge];
    }
    return {};
  }
  double distance_to(const Vec3& p, std::size_t half_edge) const {
    const auto [a, b] = table.edges[edge_of_[half_edge]];
    return norm(p - nearest_on_segment(p, point(a), point(b)));
  }

  // The largest turn of the normal about `axis` from a triangle to its neighbours, other than across `from`. Edges that
  // may be creases themselves are not counted: small polyhedra have no others.
  double bend_beside(std::size_t triangle, std::size_t from, const Vec3& axis) const {
    double largest = 0;
    for (std::size_t h = 3 * triangle; h < 3 * triangle + 3; ++h) {
      if (edge_of_[h] == from) continue;
      const Side side = cross_edge(h);
      if (side.triangle == kNoEdge) continue;
      const Vec3 n = normals_[triangle], m = side.flipped ? -normals_[side.triangle] : normals_[side.triangle];
      if (angle_between(n, m) > kSeedAngle) continue;
      const Vec3 across = m - dot(m, axis) * axis;
      if (norm2(across) > 1e-4) largest = std::max(largest, norm(across) * angle_between(n, across));
    }
    return largest;
  }

  void measure(std::size_t e) {
    if (table.half_edges.size(e) != 2) return;
    const std::size_t* h = table.half_edges.begin(e);
    const bool good0 = has_normal(h[0] / 3), good1 = has_normal(h[1] / 3);
    if (!good0 && !good1) return;
    const std::size_t from = good0 ? h[0] : h[1];
    const Side side = cross_edge(from);
    if (side.triangle == kNoEdge || side.triangle == from / 3) return;
    // A sliver lies in the fold: both its long edges see the same two normals, and only the shorter one is taken.
    if (side.edge != e && std::pair(length(e), e) > std::pair(length(side.edge), side.edge)) return;
    const Vec3 n = normals_[from / 3], m = side.flipped ? -normals_[side.triangle] : normals_[side.triangle];
    angle[e] = angle_between(n, m);
    beside[e] = {static_cast<Index>(from / 3), static_cast<Index>(side.triangle)};
    const Vec3 along = point(table.edges[e][1]) - point(table.edges[e][0]);
    if (const double l = norm(along); l > 0)
      bend[e] =
          std::max(bend_beside(from / 3, e, (1 / l) * along), bend_beside(side.triangle, side.edge, (1 / l) * along));
  }

  std::vector<std::size_t> edge_of_;  // of each half-edge
  std::vector<Vec3> normals_;         // unit; zero: look through the triangle
};

Index other_end(const std::array<Index, 2>& edge, Index v) { return edge[0] == v ? edge[1] : edge[0]; }

using Edge = std::array<Index, 2>;

// --- creases of mode automatic ---

// A seed's surface bends beside the edge by less than this part of the edge's angle.
constexpr double kSeedBend = 0.5;

// A chain of creases is continued by an edge
constexpr double kTailAngle = 10 * kRadiansPerDegree;  // whose angle, in radians, is at least this
constexpr double kTailFall = 0.3;                      // and at least this part of the angle of the edge before,
constexpr double kTailTurn = 40 * kRadiansPerDegree;   // which turns from that edge by less than this, in radians,
constexpr double kTailBend = 0.8;  // and beside which the surface bends by at most this part of the edge's angle;
constexpr double kEven = 0.8;  // that is not asked of an edge of more than this part of the angle of the one before.

// Connected creases are kept if their mean angle exceeds the first (radians) by the second times their disorder.
constexpr double kPlainFold = 30 * kRadiansPerDegree;
constexpr double kDisorderWeight = 5;
// So many inner vertices tell whether a chain is folded evenly; its disorder is then at least this part of that around
// it.
constexpr std::size_t kEnoughVertices = 12;
constexpr double kLeastDisorder = 0.4;

// Creases that touch no other feature must be as long as so many mean edges around them, unless they have many edges,
// ...
constexpr double kLeastLength = 5;
constexpr std::size_t kManyEdges = 12;
// ... and those of few edges need area beside them, in squares of their extent, unless so many triangles are there or
// the surface around them is flat (radians): the faces of a plate or a bar may be thin.
constexpr std::size_t kFewEdges = 60;
constexpr double kLeastArea = 0.02;
constexpr std::size_t kManyTriangles = 500;
constexpr double kFlat = 0.1 * kRadiansPerDegree;

class CreaseFinder {
 public:
  // `anchored` are the vertices on features of other kinds.
  CreaseFinder(const Folds& folds, const Csr<std::size_t>& at_vertex, const std::vector<char>& anchored)
      : folds_(folds), at_vertex_(at_vertex), anchored_(anchored), crease_(folds.table.edges.size(), 0) {}

  std::vector<char> find() {
    std::vector<std::size_t> seeds;
    for (std::size_t e = 0; e < crease_.size(); ++e)
      if (folds_.angle[e] > kSeedAngle && folds_.bend[e] < kSeedBend * folds_.angle[e]) seeds.push_back(e);
    for (const std::size_t e : seeds) crease_[e] = 1;
    for (const std::size_t e : seeds)
      for (const Index v : folds_.table.edges[e]) follow(e, v);
    drop_weak_components();
    return std::move(crease_);
  }

 private:
  bool has_other_crease(Index v, std::size_t edge) const {
    return std::any_of(at_vertex_.begin(v), at_vertex_.end(v), [&](std::size_t e) { return e != edge && crease_[e]; });
  }

  // Continues a chain beyond v, the end of its last edge.
  void follow(std::size_t edge, Index v) {
    while (!anchored_[v] && !has_other_crease(v, edge)) {
      const Vec3 ahead = folds_.point(v) - folds_.point(other_end(folds_.table.edges[edge], v));
      std::size_t best = kNoEdge;
      double best_score = 0;
      for (const std::size_t* e = at_vertex_.begin(v); e != at_vertex_.end(v); ++e) {
        const double angle = folds_.angle[*e];
        if (*e == edge || angle < kTailAngle || angle < kTailFall * folds_.angle[edge]) continue;
        const bool even = angle > kSeedAngle && angle > kEven * folds_.angle[edge];
        if (!even && folds_.bend[*e] > kTailBend * angle) continue;
        const Vec3 onwards = folds_.point(other_end(folds_.table.edges[*e], v)) - folds_.point(v);
        const double turn = angle_between(ahead, onwards), score = angle * std::cos(turn);
        if (turn < kTailTurn && score > best_score) {
          best = *e;
          best_score = score;
        }
      }
      if (best == kNoEdge) return;
      crease_[best] = 1;
      edge = best;
      v = other_end(folds_.table.edges[edge], v);
    }
  }

  void drop_weak_components() {
    std::vector<char> seen(crease_.size(), 0);
    std::vector<std::size_t> component;
    for (std::size_t first = 0; first < crease_.size(); ++first) {
      if (!crease_[first] || seen[first]) continue;
      component = {first};
      seen[first] = 1;
      for (std::size_t i = 0; i < component.size(); ++i)
        for (const Index v : folds_.table.edges[component[i]])
          for (const std::size_t* e = at_vertex_.begin(v); e != at_vertex_.end(v); ++e)
            if (crease_[*e] && !std::exchange(seen[*e], 1)) component.push_back(*e);
      if (!is_sound(component))
        for (const std::size_t e : component) crease_[e] = 0;
    }
  }

  // Whether most of the crease parts areas that matter. Noise folds single triangles over, and the creases around these
  // cut off next to nothing.
  bool parts_large_areas(const std::vector<std::size_t>& component, const std::vector<Index>& vertices,
                         double length) const {
    const auto farthest = [&](Index from) {
      return *std::max_element(vertices.begin(), vertices.end(), [&](Index a, Index b) {
        return norm2(folds_.point(a) - folds_.point(from)) < norm2(folds_.point(b) - folds_.point(from));
      });
    };
    const Index a = farthest(vertices.front()), b = farthest(a);
    const double extent = norm(folds_.point(b) - folds_.point(a));
    double narrow = 0;
    for (const std::size_t e : component)
      for (const std::size_t* h = folds_.table.half_edges.begin(e); h != folds_.table.half_edges.end(e); ++h)
        if (!reaches_large_area(*h / 3, 1 / extent)) {
          narrow += folds_.length(e);
          break;
        }
    return narrow < 0.5 * length;
  }

  // Whether the triangles that are reached from one without crossing creases make a large area, with lengths multiplied
  // by `scale`.
  bool reaches_large_area(std::size_t triangle, double scale) const {
    std::vector<std::size_t> part{triangle};
    double area = 0;
    for (std::size_t i = 0; i < part.size() && area < kLeastArea; ++i) {
      area += folds_.area(part[i], scale);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t e = folds_.edge_of(3 * part[i] + k);
        if (crease_[e]) continue;
        for (const std::size_t* h = folds_.table.half_edges.begin(e); h != folds_.table.half_edges.end(e); ++h)
          if (std::find(part.begin(), part.end(), *h / 3) == part.end()) part.push_back(*h / 3);
      }
      if (part.size() > kManyTriangles) return true;
    }
    return area >= kLeastArea;
  }

  // What surrounds connected creases.
  struct Surroundings {
    bool attached = false;       // a vertex is on a feature of another kind
    std::vector<double> angles;  // of the other edges at the vertices, radians
    double edge_length_sum = 0;  // of all edges at the vertices, once for each
    std::size_t edge_count = 0;
    double change_sum = 0;        // of the angle, over the vertices where just two edges of the creases meet, radians
    std::size_t inner_count = 0;  // of those vertices
  };
  Surroundings look_around(const std::vector<Index>& vertices) const {
    Surroundings s;
    for (const Index v : vertices) {
      std::vector<std::size_t> own;
      for (const std::size_t* e = at_vertex_.begin(v); e != at_vertex_.end(v); ++e) {
        if (crease_[*e]) own.push_back(*e);
        else if (folds_.beside[*e][0] != kNone) s.angles.push_back(folds_.angle[*e]);
        s.edge_length_sum += folds_.length(*e);
        ++s.edge_count;
      }
      s.attached |= anchored_[v] != 0;
      if (own.size() != 2) continue;
      s.change_sum += std::abs(folds_.angle[own[0]] - folds_.angle[own[1]]);
      ++s.inner_count;
    }
    return s;
  }

  // The lower median; 0 of nothing.
  static double median(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }

  // Creases of machined parts have about the same angle all along, or lie between faces that are hardly folded. Ridges
  // of a scan have neither, so that the smaller of both measures of disorder tells them apart.
  bool is_sound(const std::vector<std::size_t>& component) const {
    std::vector<Index> vertices;
    double length = 0, fold = 0;
    for (const std::size_t e : component) {
      length += folds_.length(e);
      fold += folds_.length(e) * folds_.angle[e];
      for (const Index v : folds_.table.edges[e]) vertices.push_back(v);
    }
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());

    const Surroundings around = look_around(vertices);
    if (!around.attached && component.size() < kManyEdges &&
        length * static_cast<double>(around.edge_count) < kLeastLength * around.edge_length_sum)
      return false;
    double disorder = median(around.angles);
    if (!around.attached && component.size() < kFewEdges && disorder > kFlat &&
        !parts_large_areas(component, vertices, length))
      return false;
    if (around.inner_count >= kEnoughVertices)
      disorder =
          std::clamp(around.change_sum / static_cast<double>(around.inner_count), kLeastDisorder * disorder, disorder);
    return fold > length * (kPlainFold + kDisorderWeight * disorder);
  }

  const Folds& folds_;
  const Csr<std::size_t>& at_vertex_;
  const std::vector<char>& anchored_;
  std::vector<char> crease_;  // of each edge
};

// --- corners ---

// Edges are tiny if they are shorter than this part of the longest of so many feature edges to either side.
constexpr double kTiny = 0.2;
constexpr int kNearBy = 3;
// The two edges at a corner themselves turn by at least this part of the corner angle.
constexpr double kOwnTurn = 0.7;
// The angles around a cone's tip are short of a full turn by more than the first (radians), those around its neighbours
// by less than the given part of that, and the surface folds by less than the last (radians) at the edges opposite the
// tip.
constexpr double kTipDeficit = 54 * kRadiansPerDegree;
constexpr double kTipContrast = 0.25;
constexpr double kTipFold = 15 * kRadiansPerDegree;

class GraphBuilder {
 public:
  // `kinds` holds a FeatureKind for each edge, or kPlain.
  static constexpr std::uint8_t kPlain = 255;
  GraphBuilder(const Folds& folds, const Csr<std::size_t>& at_vertex, const std::vector<std::uint8_t>& kinds,
               const std::vector<std::int32_t>& labels, double corner_angle)
      : folds_(folds), at_vertex_(at_vertex), kinds_(kinds), labels_(labels), corner_angle_(corner_angle) {}

  FeatureGraph build(const std::vector<Triangle>& triangles, bool tips) {
    const std::size_t vertices = at_vertex_.rows();
    corner_.assign(vertices, 0);
    turn_.assign(vertices, 0);
    on_feature_.assign(vertices, 0);
    parallel_each(vertices, [&](std::size_t v) { judge(static_cast<Index>(v)); });
    keep_sharpest_turns();
    if (tips) find_tips(triangles);
    FeatureGraph graph;
    for (std::size_t e = 0; e < kinds_.size(); ++e)
      if (kinds_[e] != kPlain) graph.edges.push_back(folds_.table.edges[e]);
    for (std::size_t v = 0; v < vertices; ++v)
      if (corner_[v]) graph.corners.push_back(static_cast<Index>(v));
    trace(graph);
    return graph;
  }

 private:
  struct Pair {
    std::size_t count = 0;
    std::array<std::size_t, 2> edges{};
  };
  // The feature edges at a vertex, the first two of them by index.
  Pair features_at(Index v) const {
    Pair pair;
    for (const std::size_t* e = at_vertex_.begin(v); e != at_vertex_.end(v); ++e) {
      if (kinds_[*e] == kPlain) continue;
      if (pair.count < 2) pair.edges[pair.count] = *e;
      ++pair.count;
    }
    return pair;
  }

  std::array<std::int32_t, 2> labels_beside(std::size_t e) const {
    std::array<std::int32_t, 2> pair{};
    if (labels_.empty() || folds_.beside[e][0] == kNone) return pair;
    pair = {labels_[folds_.beside[e][0]], labels_[folds_.beside[e][1]]};
    std::sort(pair.begin(), pair.end());
    return pair;
  }

  void judge(Index v) {
    const Pair pair = features_at(v);
    on_feature_[v] = pair.count > 0;
    if (has_several_fans(v)) corner_[v] = 1;
    if (pair.count == 0) return;
    if (pair.count != 2 || kinds_[pair.edges[0]] != kinds_[pair.edges[1]] ||
        labels_beside(pair.edges[0]) != labels_beside(pair.edges[1])) {
      corner_[v] = 1;
      return;
    }
    turn_[v] = turn_at(v, pair);
  }

  // Whether the triangles at v, linked through edges, fall apart.
  bool has_several_fans(Index v) const {
    const std::size_t* begin = at_vertex_.begin(v);
    const std::size_t* end = at_vertex_.end(v);
    const auto place = [&](std::size_t e) { return static_cast<std::size_t>(std::lower_bound(begin, end, e) - begin); };
    std::size_t fans = at_vertex_.size(v);
    DisjointSets linked(fans);
    for (const std::size_t* e = begin; e != end; ++e)
      for (const std::size_t* h = folds_.table.half_edges.begin(*e); h != folds_.table.half_edges.end(*e); ++h)
        for (std::size_t k = 3 * (*h / 3); k < 3 * (*h / 3) + 3; ++k) {
          const std::size_t other = folds_.edge_of(k);
          const Edge& ends = folds_.table.edges[other];
          if (other == *e || (ends[0] != v && ends[1] != v)) continue;
          if (linked.join(place(*e), place(other))) --fans;
        }
    return fans > 1;
  }

  // The feature edge that continues a curve at v; kNoEdge at its end.
  std::size_t next_edge(std::size_t edge, Index v) const {
    const Pair pair = features_at(v);
    if (pair.count != 2) return kNoEdge;
    return pair.edges[0] == edge ? pair.edges[1] : pair.edges[0];
  }

  double longest_near(Index v, std::size_t edge) const {
    double longest = 0;
    for (int i = 0; i < kNearBy && edge != kNoEdge; ++i) {
      longest = std::max(longest, folds_.length(edge));
      v = other_end(folds_.table.edges[edge], v);
      edge = next_edge(edge, v);
    }
    return longest;
  }

  // Calls body(vertex) for what follows v on a curve, until it returns false or the curve ends or comes back.
  template <class Body>
  void walk(Index v, std::size_t edge, const Body& body) const {
    const Index start = v;
    while (edge != kNoEdge) {
      v = other_end(folds_.table.edges[edge], v);
      if (v == start || !body(v)) return;
      edge = next_edge(edge, v);
    }
  }

  double tiny_at(Index v, const Pair& pair) const {
    return kTiny * std::max(longest_near(v, pair.edges[0]), longest_near(v, pair.edges[1]));
  }

  // The first vertex beyond `reach` of v.
  Vec3 ahead(Index v, std::size_t edge, double reach) const {
    Vec3 p = folds_.point(v);
    walk(v, edge, [&](Index w) {
      p = folds_.point(w);
      return norm(p - folds_.point(v)) < reach;
    });
    return p;
  }

  // The turn of a curve at v, measured across tiny edges; 0 where the two edges at v hardly turn.
  double turn_at(Index v, const Pair& pair) const {
    const auto turn = [&](double reach) {
      const Vec3 p = folds_.point(v);
      return angle_between(p - ahead(v, pair.edges[0], reach), ahead(v, pair.edges[1], reach) - p);
    };
    return turn(0) > kOwnTurn * corner_angle_ ? turn(tiny_at(v, pair)) : 0;
  }

  // Where only tiny edges lie between sharp turns, the sharpest of them is a corner.
  void keep_sharpest_turns() {
    std::vector<Index> sharp;
    for (std::size_t v = 0; v < turn_.size(); ++v)
      if (!corner_[v] && turn_[v] > corner_angle_) sharp.push_back(static_cast<Index>(v));
    std::vector<char> wins(sharp.size(), 1);
    for (std::size_t i = 0; i < sharp.size(); ++i) {
      const Index v = sharp[i];
      const Pair pair = features_at(v);
      const double reach = tiny_at(v, pair);
      for (const std::size_t edge : pair.edges)
        walk(v, edge, [&](Index w) {
          if (norm(folds_.point(w) - folds_.point(v)) >= reach) return false;
          if (corner_[w] || turn_[w] > turn_[v] || (turn_[w] == turn_[v] && w < v)) wins[i] = 0;
          return true;
        });
    }
    for (std::size_t i = 0; i < sharp.size(); ++i)
      if (wins[i]) corner_[sharp[i]] = 1;
  }

  // Marks the tips of cones: the angles around a tip are far short of a full turn, those around its neighbours are not,
  // and the surface goes on smoothly from the triangles at the tip.
  void find_tips(const std::vector<Triangle>& triangles) {
    std::vector<double> deficit(at_vertex_.rows(), 2 * std::numbers::pi);
    for (const Triangle& t : triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& p = folds_.point(t[k]);
        deficit[t[k]] -= angle_between(folds_.point(t[(k + 1) % 3]) - p, folds_.point(t[(k + 2) % 3]) - p);
      }
    for (Index v = 0; v < deficit.size(); ++v) {
      if (on_feature_[v] || at_vertex_.size(v) == 0 || deficit[v] < kTipDeficit) continue;
      bool tip = true;
      for (const std::size_t* e = at_vertex_.begin(v); tip && e != at_vertex_.end(v); ++e) {
        const Index w = other_end(folds_.table.edges[*e], v);
        tip = on_feature_[w] || std::abs(deficit[w]) < kTipContrast * deficit[v];
        for (const std::size_t* h = folds_.table.half_edges.begin(*e); tip && h != folds_.table.half_edges.end(*e); ++h)
          for (std::size_t k = 3 * (*h / 3); k < 3 * (*h / 3) + 3; ++k) {
            const std::size_t rim = folds_.edge_of(k);
            const Edge& ends = folds_.table.edges[rim];
            if (ends[0] != v && ends[1] != v && kinds_[rim] == kPlain && folds_.angle[rim] > kTipFold) tip = false;
          }
      }
      if (tip) corner_[v] = 1;
    }
  }

  void trace(FeatureGraph& graph) const {
    std::vector<char> done(kinds_.size(), 0);
    const auto follow = [&](Index v, std::size_t edge) {
      FeatureCurve curve;
      curve.kind = static_cast<FeatureKind>(kinds_[edge]);
      curve.vertices.push_back(v);
      while (edge != kNoEdge && !std::exchange(done[edge], 1)) {
        v = other_end(folds_.table.edges[edge], v);
        curve.vertices.push_back(v);
        edge = corner_[v] ? kNoEdge : next_edge(edge, v);
      }
      if (!corner_[curve.vertices[0]]) {
        curve.vertices.pop_back();
        curve.closed = true;
      }
      graph.curves.push_back(std::move(curve));
    };
    for (const Index v : graph.corners)
      for (const std::size_t* e = at_vertex_.begin(v); e != at_vertex_.end(v); ++e)
        if (kinds_[*e] != kPlain && !done[*e]) follow(v, *e);
    for (std::size_t e = 0; e < kinds_.size(); ++e)
      if (kinds_[e] != kPlain && !done[e]) follow(folds_.table.edges[e][0], e);
  }

  const Folds& folds_;
  const Csr<std::size_t>& at_vertex_;
  const std::vector<std::uint8_t>& kinds_;
  const std::vector<std::int32_t>& labels_;
  const double corner_angle_;
  std::vector<char> corner_, on_feature_;
  std::vector<double> turn_;  // of the curve at each vertex inside one
};

void check(const TriangleMesh& mesh, const FeatureOptions& options) {
  for (const auto& [name, angle] : {std::pair{"feature", options.angle}, {"corner", options.corner_angle}})
    if (!(angle > 0 && angle < 180))
      throw Error(fmt::format("{} angle {}: give degrees between 0 and 180", name, angle));
  if (!mesh.labels.empty() && mesh.labels.size() != mesh.triangles.size())
    throw Error(fmt::format("{} labels for {} triangles; give one each", mesh.labels.size(), mesh.triangles.size()));
}

void mark_given(const std::vector<Edge>& edges, const EdgeTable& table, std::vector<std::uint8_t>& kinds) {
  constexpr auto kGiven = static_cast<std::uint8_t>(FeatureKind::given);
  for (const Edge& given : edges) {
    const Edge e{std::min(given[0], given[1]), std::max(given[0], given[1])};
    const auto at = std::lower_bound(table.edges.begin(), table.edges.end(), e);
    if (at == table.edges.end() || *at != e)
      throw Error(fmt::format("feature edge {} {} is not an edge of the mesh; remove it", given[0], given[1]));
    std::uint8_t& kind = kinds[static_cast<std::size_t>(at - table.edges.begin())];
    kind = std::min(kind, kGiven);
  }
}

// A FeatureKind for each edge, or GraphBuilder::kPlain. `labels` are those of the triangles of `folds`, or none.
std::vector<std::uint8_t> classify_edges(const TriangleMesh& mesh, const FeatureOptions& options, const Folds& folds,
                                         const std::vector<std::int32_t>& labels, const Csr<std::size_t>& at_vertex) {
  const EdgeTable& table = folds.table;
  std::vector<std::uint8_t> kinds(table.edges.size(), GraphBuilder::kPlain);
  const auto mark = [&](std::size_t e, FeatureKind kind) {
    kinds[e] = std::min(kinds[e], static_cast<std::uint8_t>(kind));
  };
  for (std::size_t e = 0; e < kinds.size(); ++e) {
    const std::size_t sides = table.half_edges.size(e);
    if (sides != 2) mark(e, sides == 1 ? FeatureKind::border : FeatureKind::non_manifold);
  }
  mark_given(options.given, table, kinds);
  if (options.mode != FeatureMode::none) {
    mark_given(mesh.feature_edges, table, kinds);
    for (std::size_t e = 0; e < kinds.size(); ++e)
      if (const auto [left, right] = folds.beside[e]; !labels.empty() && left != kNone && labels[left] != labels[right])
        mark(e, FeatureKind::label);
  }
  if (options.mode == FeatureMode::degrees) {
    for (std::size_t e = 0; e < kinds.size(); ++e)
      if (folds.angle[e] > options.angle * kRadiansPerDegree) mark(e, FeatureKind::crease);
  } else if (options.mode == FeatureMode::automatic) {
    std::vector<char> anchored(mesh.vertices.size(), 0);
    for (std::size_t e = 0; e < kinds.size(); ++e)
      if (kinds[e] != GraphBuilder::kPlain)
        for (const Index v : table.edges[e]) anchored[v] = 1;
    const std::vector<char> crease = CreaseFinder(folds, at_vertex, anchored).find();
    for (std::size_t e = 0; e < kinds.size(); ++e)
      if (crease[e]) mark(e, FeatureKind::crease);
  }
  return kinds;
}

// The graph of a mesh whose triangles are those given.
FeatureGraph find_graph(const TriangleMesh& mesh, const std::vector<Triangle>& triangles,
                        const std::vector<std::int32_t>& labels, const FeatureOptions& options) {
  const Folds folds(mesh.vertices, triangles);
  const Csr<std::size_t> at_vertex = items_at_vertices<std::size_t>(folds.table.edges, mesh.vertices.size());
  const std::vector<std::uint8_t> kinds = classify_edges(mesh, options, folds, labels, at_vertex);
  return GraphBuilder(folds, at_vertex, kinds, labels, options.corner_angle * kRadiansPerDegree)
      .build(triangles, options.mode != FeatureMode::none);
}

std::vector<Edge> given_edges(const TriangleMesh& mesh, const FeatureOptions& options) {
  std::vector<Edge> edges = options.given;
  edges.insert(edges.end(), mesh.feature_edges.begin(), mesh.feature_edges.end());
  return edges;
}

// Puts the vertices back that the mesh has along the edges of the graph.
void restore_chains(const PlanarReduction& reduced, FeatureGraph& graph) {
  std::vector<Edge> edges;
  for (const Edge& e : graph.edges) {
    const std::vector<Index> chain = reduced.chain(e[0], e[1]);
    for (std::size_t k = 0; k + 1 < chain.size(); ++k)
      edges.push_back({std::min(chain[k], chain[k + 1]), std::max(chain[k], chain[k + 1])});
  }
  std::sort(edges.begin(), edges.end());
  graph.edges = std::move(edges);
  for (FeatureCurve& curve : graph.curves) {
    std::vector<Index> vertices;
    const std::size_t count = curve.vertices.size();
    for (std::size_t k = 0; k + (curve.closed ? 0 : 1) < count; ++k) {
      const std::vector<Index> chain = reduced.chain(curve.vertices[k], curve.vertices[(k + 1) % count]);
      vertices.insert(vertices.end(), chain.begin(), chain.end() - 1);
    }
    if (!curve.closed) vertices.push_back(curve.vertices.back());
    curve.vertices = std::move(vertices);
  }
}

}  // namespace

FeatureGraph detect_features(const TriangleMesh& mesh, const FeatureOptions& options) {
  check(mesh, options);
  std::vector<Triangle> triangles;  // of three corners
  std::vector<std::int32_t> labels;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    triangles.push_back(t);
    if (!mesh.labels.empty()) labels.push_back(mesh.labels[i]);
  }
  if (options.mode != FeatureMode::automatic) return find_graph(mesh, triangles, labels, options);
  // What makes a crease is judged by what lies beside it and around it. On a mesh divided into smaller triangles that
  // would be flat everywhere.
  const PlanarReduction reduced(mesh.vertices, triangles, labels, given_edges(mesh, options));
  if (reduced.triangles.size() == triangles.size()) return find_graph(mesh, triangles, labels, options);
  std::vector<std::int32_t> left;
  for (const Index t : reduced.origin)
    if (!labels.empty()) left.push_back(labels[t]);
  FeatureGraph graph = find_graph(mesh, reduced.triangles, left, options);
  restore_chains(reduced, graph);
  return graph;
}

}  // namespace bisector
