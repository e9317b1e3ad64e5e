// A part of the dual as a triangulation that can be tried out: seeds move, appear and vanish, edges follow by Delaunay
// flips. It is a guess at the restricted Delaunay triangulation that costs microseconds; the diagram has the last word
// (improve.h).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "backend/project.h"
#include "core/geometry.h"
#include "features/curves.h"
#include "voronoi/surface.h"

namespace bisector {

// Degrees. A smaller angle is bad, unless curves impose it.
inline constexpr double kBadAngle = 30;

// The angles that triangles should stay between, in degrees, and the cosines from which on they cost more.
struct ShapeGoal {
  double min_angle, max_angle, near_min, near_max;
};

ShapeGoal shape_goal(double min_angle, double max_angle);

// 0 for an equilateral triangle. Grows with 1 - Q (mesh/quality.h), with the smallest angle's cosine, and fast beyond
// the goal.
double shape_cost(const Vec3& a, const Vec3& b, const Vec3& c, const ShapeGoal& goal);
// By how many degrees the smallest angle is less than it should be and the largest one more.
struct ShapeExcess {
  double under = 0, over = 0;

  double most() const { return under > over ? under : over; }
  bool within(const ShapeExcess& b) const { return under <= b.under && over <= b.over; }
  // The worse of both in either respect.
  void take(const ShapeExcess& b) {
    if (b.under > under) under = b.under;
    if (b.over > over) over = b.over;
  }
};
ShapeExcess shape_excess(const Vec3& a, const Vec3& b, const Vec3& c, const ShapeGoal& goal);
// Both in little more time than one of them takes.
std::pair<double, ShapeExcess> shape_cost_and_excess(const Vec3& a, const Vec3& b, const Vec3& c,
                                                     const ShapeGoal& goal);

// Whether the smallest angle is between two locked edges, which curves give it. `locked` tells of the edges from each
// corner to the next.
bool angle_is_imposed(const std::array<Vec3, 3>& corners, const std::array<bool, 3>& locked);
// By how much the smallest of the other angles, those that are not between two locked edges, is less than so many
// degrees; 0 if it is not.
double free_angle_lack(const std::array<Vec3, 3>& corners, const std::array<bool, 3>& locked, double degrees);

// The surface by the cells of a diagram: the nearest seed of a point owns the piece of the surface that the point goes
// to, which keeps points on their sheet.
class CellMap {
 public:
  // `cells` are the triangles of each cell, `rings` the neighbours of each seed in the dual. All must outlive the
  // object.
  CellMap(const Surface& surface, const std::vector<Vec3>& seeds, const Csr<Index>& cells, const Csr<Index>& rings)
      : surface_(surface), seeds_(seeds), cells_(cells), rings_(rings) {}

  const Surface& surface() const { return surface_; }
  // Puts p on the surface near the cell `owner`, which becomes the one that p is in. Sets the unit normal there.
  Vec3 project(const Vec3& p, Index& owner, Vec3& normal) const;
  // The mesh triangle of the surface that it is put on; kNone if the cell has none.
  Index triangle_at(const Vec3& p, Index owner) const;

 private:
  SurfacePoint foot(const Vec3& p, Index& owner) const;

  const Surface& surface_;
  const std::vector<Vec3>& seeds_;
  const Csr<Index>& cells_;
  const Csr<Index>& rings_;
};

struct PatchVertex {
  Vec3 x, normal;  // the normal is 0 where the seed is not on the surface alone
  SeedPlace place;
  Index owner = kNone;  // cell of the map that it is in
  Index seed = kNone;   // its index outside, if it has one
  bool free = false;
  bool removed = false;
  Index outside = 0;  // triangles at it that are not in the patch
  double step = 0;    // length that the next moves are tried with; 0 before the first
  Vec3 start;         // where it was before that
};

// An edge that stays, lower vertex first, and the curve that it follows; kNone if that is not known.
struct LockedEdge {
  Index a, b;
  Index curve = kNone;
};

// Which curve two seeds are neighbours on.
class CurvesBetween {
 public:
  explicit CurvesBetween(const FeatureCurves& curves);

  // kNone if it passes one of them, which is the corner of others, or if there is more than one between two corners.
  Index operator()(const SeedPlace& u, const SeedPlace& v) const;
  // That end there.
  const std::vector<Index>& at_corner(Index corner) const { return at_corner_[corner]; }

 private:
  const FeatureCurves& curves_;
  std::vector<std::vector<Index>> at_corner_;
};

class ImprovePatch {
 public:
  // `curves` may be null if no vertex is on one. Both must outlive the object, and its copies.
  ImprovePatch(const CellMap& map, const FeatureCurves* curves, const ShapeGoal& goal)
      : map_(&map), curves_(curves), goal_(goal) {}

  Index add_vertex(const PatchVertex& vertex);
  void add_triangle(const Triangle& t);
  // All at once, in place of what was there; `stars` are the triangles at each vertex.
  void set_mesh(const std::vector<PatchVertex>& vertices, const std::vector<Triangle>& triangles,
                const Csr<Index>& stars);
  // `degree`: triangles at the vertex, here and outside.
  void set_outside(Index v, std::size_t degree) {
    vertices_[v].outside = static_cast<Index>(degree - stars_[v].size());
  }
  // In any order; an edge may be there more than once.
  void lock(std::vector<LockedEdge> edges);

  const std::vector<PatchVertex>& vertices() const { return vertices_; }
  std::vector<Triangle> triangles() const;
  const std::vector<LockedEdge>& locked() const { return locked_; }
  // How many vertices are nearer to a locked edge's stretch of its curve than the edge's ends: their cells cut the
  // curve.
  std::size_t encroachments() const;
  // Sum of the triangles' costs, each less `average`; so much for each triangle that a vertex on the surface has more
  // or fewer than six; and a high price for each encroachment.
  double cost(double average, double irregular) const;
  // The same without encroachments.
  double shape_cost_sum(double average, double irregular) const;
  // What angles that are not imposed lack to so many degrees: sum of the squares, and the most. Triangles without a
  // free vertex count, too.
  struct Lack {
    double squares = 0, most = 0;
  };
  Lack lack(double degrees) const;

  // Whether any triangle has turned over.
  bool is_folded() const;
  // By how much the worst triangles miss the goal.
  ShapeExcess worst() const;

  // Each is false, and nothing is changed, if the triangulation has no room for it.
  bool remove(Index v);               // corners and what is not free stay
  bool split(Index a, Index b);       // inserts a vertex on the edge, on the curve if it is locked
  bool insert(std::size_t triangle);  // inserts a vertex in the triangle
  bool flip(Index a, Index b);
  // Makes an edge of the curve between two vertices by flips, and locks it. What is false may have flipped some
  // already.
  bool connect(Index a, Index b, Index curve);

  // The edges at v and opposite to it whose flip brings the degrees nearest to six, best first.
  std::vector<std::array<Index, 2>> wanted_flips(Index v) const;
  // The edges of the costliest triangle that has a free vertex and whose bad angles are not all imposed, and of those
  // beside it.
  std::vector<std::array<Index, 2>> edges_at_worst() const;
  // The vertex at the far end of v's longest edge, and the triangle at v of the largest area.
  Index farthest_neighbour(Index v) const;
  std::size_t largest_triangle(Index v) const;

  // Flips edges until all are Delaunay, as far as the locked ones allow.
  void make_delaunay();
  // Moves v to where its triangles, and `hold` times the square of its way from the start in edge lengths, cost less;
  // true if it moved. Touches nothing but v and the costs of its triangles.
  bool relax(Index v, double hold);
  // Relaxes the free vertices in order, so many times, with flips in between.
  void relax_all(int sweeps);

 private:
  struct PatchTriangle {
    Triangle v;
    Vec3 facing;  // unit normal that its own may not turn away from; 0: any
    double cost = 0;
    bool alive = true;
  };

  std::array<bool, 3> locked_edges(const PatchTriangle& t) const;
  PatchTriangle make_triangle(const Triangle& t) const;
  bool turns(const Triangle& t, const Vec3& facing) const;
  double cost_of(const PatchTriangle& t) const;
  double star_cost(Index v) const;
  int excess_degree(Index v) const;
  const LockedEdge* locked_edge(Index a, Index b) const;  // null if it is not locked
  bool is_locked(Index a, Index b) const { return locked_edge(a, b); }
  void set_locked(Index a, Index b, Index curve);
  void unlock(Index a, Index b);
  // The positions of an edge's ends on its curve; beyond the ends of a closed one if the edge leads over its start.
  std::array<double, 2> stretch(const LockedEdge& edge) const;
  // The triangles at an edge; false unless there are two that agree in orientation.
  bool triangles_at(Index a, Index b, std::size_t& left, std::size_t& right) const;
  // facing_of(triangle, the mean of what the two faced before) of the triangles that a flip makes.
  template <class Facing>
  bool flip_facing(Index a, Index b, const Facing& facing_of);
  // Where triangles lead across a curve, their own normals say little.
  bool flip_by_surface(Index a, Index b);
  // The edge across from `from` that the way to `to` crosses.
  bool crossed_edge(Index from, Index to, std::array<Index, 2>& edge) const;
  bool flip_on_the_way(Index from, Index to);
  void replace(std::size_t t, const Triangle& corners, const Vec3& facing);
  void kill(std::size_t t);
  bool collapse(Index v, Index to);
  bool can_collapse(Index v, Index to) const;
  PatchVertex between(Index a, Index b) const;

  const CellMap* map_;
  const FeatureCurves* curves_;
  ShapeGoal goal_;
  std::vector<PatchVertex> vertices_;
  std::vector<PatchTriangle> triangles_;
  std::vector<std::vector<Index>> stars_;  // triangles at each vertex
  std::vector<LockedEdge> locked_;         // sorted
};

struct SearchLimits {
  int steps;
  std::size_t width;  // results that are gone on from
  int sweeps;         // of relaxation after each change
  double alike;       // of results whose costs differ by less one is enough
};

// A beam search: splits, flips and removals at the worst triangle, one after the other, of which those that cost least
// are gone on from. Calls visit(patch, cost, gone_on_from) for the results of each step, by cost.
template <class Cost, class Visit>
void search_changes(const ImprovePatch& start, const SearchLimits& limits, const Cost& cost_of, const Visit& visit) {
  struct State {
    ImprovePatch patch;
    double cost;
  };
  const auto less = [](const State& s, const State& t) { return s.cost < t.cost; };
  const auto alike = [&](const State& s, const State& t) { return std::abs(s.cost - t.cost) < limits.alike; };
  std::vector<State> beam{{start, 0}};
  for (int step = 0; step < limits.steps; ++step) {
    std::vector<State> next;
    for (const State& state : beam) {
      const auto attempt = [&](const auto& operation) {
        ImprovePatch patch = state.patch;
        if (!operation(patch)) return;
        patch.relax_all(limits.sweeps);
        const double cost = cost_of(patch);
        next.push_back({std::move(patch), cost});
      };
      std::vector<Index> vertices;
      for (const auto& [a, b] : state.patch.edges_at_worst()) {
        attempt([&](ImprovePatch& patch) { return patch.split(a, b); });
        attempt([&](ImprovePatch& patch) { return patch.flip(a, b); });
        for (const Index v : {a, b})
          if (std::find(vertices.begin(), vertices.end(), v) == vertices.end()) vertices.push_back(v);
      }
      for (const Index v : vertices) attempt([&](ImprovePatch& patch) { return patch.remove(v); });
    }
    std::stable_sort(next.begin(), next.end(), less);
    next.erase(std::unique(next.begin(), next.end(), alike), next.end());
    for (std::size_t k = 0; k < next.size(); ++k) visit(next[k].patch, next[k].cost, k < limits.width);
    if (next.size() > limits.width) next.erase(next.begin() + static_cast<std::ptrdiff_t>(limits.width), next.end());
    beam = std::move(next);
  }
}

}  // namespace bisector
