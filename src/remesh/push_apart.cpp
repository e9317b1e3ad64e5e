#include "remesh/push_apart.h"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "mesh/triangle_quality.h"
#include "mesh/used_vertices.h"

namespace bisector {
namespace {

using Pair = std::array<Index, 2>;
using Corners = std::array<Vec3, 3>;
using TriangleBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, Index>;

constexpr double kGoodAngle = 30;  // degrees
constexpr double kTurned = 0.8;    // cosine of the angle by which triangles turn, at least
constexpr double kFarthest = 0.1;  // of the mean of the edges at a vertex: how far it goes
constexpr double kGap = 1e-3;      // of the same: what is left between triangles
constexpr int kRounds = 40, kPatience = 8;
constexpr std::size_t kVerticesPerPair = 2;  // with fewer it is a soup
constexpr int kHalvings = 3;                 // of a step that would spoil a triangle

// Two triangles are on either side of a plane if the first one's corners come down to it along `direction`, and the
// second one's up.
struct Push {
  Vec3 direction;  // of unit length
  double plane = 0, overlap = std::numeric_limits<double>::infinity();
};

struct Range {
  double low, high;
};

Range range_along(const Corners& x, const Vec3& d) {
  const auto [low, high] = std::minmax({dot(x[0], d), dot(x[1], d), dot(x[2], d)});
  return {low, high};
}

// The least overlap over the directions in which two triangles that are disjoint can be told to be. `shared`: a corner
// they have in common, which stays on the plane.
Push least_push(const Corners& s, const Corners& t, const std::optional<Vec3>& shared) {
  Push best;
  const auto consider = [&](Vec3 d) {
    const double length = norm(d);
    if (!(length > 0)) return;
    d = (1 / length) * d;
    const Range a = range_along(s, d), b = range_along(t, d);
    for (const double sign : {1.0, -1.0}) {
      const Range first = sign > 0 ? a : Range{-a.high, -a.low}, second = sign > 0 ? b : Range{-b.high, -b.low};
      double plane = 0.5 * (first.high + second.low), overlap = first.high - second.low;
      if (shared) {
        plane = sign * dot(*shared, d);
        overlap = std::max(first.high - plane, plane - second.low);
      }
      if (overlap < best.overlap) best = {sign * d, plane, overlap};
    }
  };
  const auto edge = [](const Corners& x, std::size_t k) { return x[(k + 1) % 3] - x[k]; };
  const Vec3 n = twice_area_normal(s[0], s[1], s[2]), m = twice_area_normal(t[0], t[1], t[2]);
  consider(n);
  consider(m);
  for (std::size_t i = 0; i < 3; ++i) {
    consider(cross(n, edge(s, i)));
    consider(cross(m, edge(t, i)));
    for (std::size_t j = 0; j < 3; ++j) {
      // Of edges that are all but parallel the product is rounding.
      const Vec3 a = edge(s, i), b = edge(t, j), c = cross(a, b);
      if (norm2(c) > 1e-12 * norm2(a) * norm2(b)) consider(c);
    }
  }
  return best;
}

TriangleBox box_of(const TriangleMesh& mesh, Index t, double around) {
  const Box box = bounding_box(mesh.vertices, {mesh.triangles[t]});
  const double by = around * box.diagonal();
  return {{box.lo.x - by, box.lo.y - by, box.lo.z - by, box.hi.x + by, box.hi.y + by, box.hi.z + by}, t};
}

// The triangles that meet the boxes of those of the pairs, with as much around these as they are large; ascending.
std::vector<Index> triangles_around(const TriangleMesh& mesh, const std::vector<Pair>& pairs) {
  std::vector<TriangleBox> crossing, all;
  for (const Pair& pair : pairs)
    for (const Index t : pair) crossing.push_back(box_of(mesh, t, 1));
  for (Index t = 0; t < mesh.triangles.size(); ++t) all.push_back(box_of(mesh, t, 0));
  std::vector<char> is_near(mesh.triangles.size(), 0);
  CGAL::box_intersection_d(crossing.begin(), crossing.end(), all.begin(), all.end(),
                           [&](const TriangleBox&, const TriangleBox& near) { is_near[near.info()] = 1; });
  std::vector<Index> near;
  for (Index t = 0; t < is_near.size(); ++t)
    if (is_near[t]) near.push_back(t);
  return near;
}

// Some triangles of a mesh. Vertices and triangles keep their order.
struct Part {
  TriangleMesh mesh;
  std::vector<Index> vertices;  // of the whole mesh
  std::vector<char> movable;    // those that are, and have no other triangles
};

Part part_of(const TriangleMesh& whole, const std::vector<Index>& triangles, const std::vector<char>& movable) {
  Part part;
  for (const Index t : triangles) part.mesh.triangles.push_back(whole.triangles[t]);
  part.vertices = used_vertices(part.mesh.triangles, whole.vertices.size());
  std::vector<std::ptrdiff_t> others(whole.vertices.size(), 0);
  for (const Triangle& t : whole.triangles)
    for (const Index v : t) ++others[v];
  for (const Triangle& t : part.mesh.triangles)
    for (const Index v : t) --others[v];
  std::vector<Index> number(whole.vertices.size(), kNone);
  for (const Index v : part.vertices) {
    number[v] = static_cast<Index>(part.mesh.vertices.size());
    part.mesh.vertices.push_back(whole.vertices[v]);
    part.movable.push_back(movable[v] && others[v] == 0);
  }
  for (Triangle& t : part.mesh.triangles)
    for (Index& v : t) v = number[v];
  return part;
}

class PushApart {
 public:
  PushApart(TriangleMesh mesh, std::vector<char> movable, const Context& context)
      : mesh_(std::move(mesh)), movable_(std::move(movable)), context_(context), start_(mesh_.vertices),
        at_(mesh_.vertices.size()), length_(mesh_.vertices.size(), 0) {
    for (Index t = 0; t < mesh_.triangles.size(); ++t) {
      const Triangle& v = mesh_.triangles[t];
      for (std::size_t k = 0; k < 3; ++k) {
        at_[v[k]].push_back(t);
        const double length = norm(mesh_.vertices[v[(k + 1) % 3]] - mesh_.vertices[v[k]]);
        length_[v[k]] += length;
        length_[v[(k + 1) % 3]] += length;
      }
      angle_.push_back(std::min(kGoodAngle, least_angle(mesh_, v)));
      normal_.push_back(normal_of(v));
    }
    // Two edges of each triangle.
    for (std::size_t v = 0; v < length_.size(); ++v) length_[v] /= 2 * static_cast<double>(at_[v].size());
  }

  // The vertices with which the fewest pairs cross.
  std::vector<Vec3> run() {
    std::vector<Pair> pairs = find_self_intersections(mesh_, context_);
    std::vector<Vec3> best = mesh_.vertices;
    std::size_t fewest = pairs.size();
    for (int round = 0, idle = 0; fewest > 0 && round < kRounds && idle < kPatience; ++round, ++idle) {
      if (!push(pairs)) break;
      pairs = find_self_intersections(mesh_, context_);
      if (pairs.size() >= fewest) continue;
      fewest = pairs.size();
      best = mesh_.vertices;
      idle = 0;
    }
    return best;
  }

 private:
  Corners corners(const Triangle& t) const {
    return {mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]]};
  }
  Vec3 normal_of(const Triangle& t) const {
    return unit(twice_area_normal(mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]]));
  }

  // All pairs at once; a vertex goes the mean of the ways that its pairs want. Whether any vertex went.
  bool push(const std::vector<Pair>& pairs) {
    std::vector<Vec3> way(mesh_.vertices.size());
    std::vector<double> count(mesh_.vertices.size(), 0);
    for (const auto& [i, j] : pairs) add_ways(mesh_.triangles[i], mesh_.triangles[j], way, count);
    bool any = false;
    for (Index v = 0; v < way.size(); ++v)
      if (count[v] > 0) any |= move(v, (1 / count[v]) * way[v]);
    return any;
  }

  void add_ways(const Triangle& s, const Triangle& t, std::vector<Vec3>& way, std::vector<double>& count) const {
    std::optional<Vec3> shared;
    for (const Index v : s)
      for (const Index w : t)
        if (mesh_.vertices[v] == mesh_.vertices[w]) {
          if (shared) return;  // folded onto each other at an edge
          shared = mesh_.vertices[v];
        }
    Push push = least_push(corners(s), corners(t), shared);
    double gap = std::numeric_limits<double>::infinity(), reach = 0;
    bool first_moves = false, second_moves = false;
    for (const Index v : s) first_moves |= goes(v, dot(mesh_.vertices[v], push.direction) - push.plane);
    for (const Index v : t) second_moves |= goes(v, push.plane - dot(mesh_.vertices[v], push.direction));
    for (const Triangle* both : {&s, &t})
      for (const Index v : *both) {
        gap = std::min(gap, kGap * length_[v]);
        reach = std::max(reach, kFarthest * length_[v]);
      }
    if (push.overlap > 2 * reach) return;
    if (!shared && first_moves != second_moves) push.plane += (first_moves ? -0.5 : 0.5) * push.overlap;
    for (const Index v : s) add_way(v, push, dot(mesh_.vertices[v], push.direction) - push.plane + gap, -1, way, count);
    for (const Index v : t) add_way(v, push, push.plane - dot(mesh_.vertices[v], push.direction) + gap, 1, way, count);
  }

  bool goes(Index v, double beyond) const { return movable_[v] && beyond > 0; }

  void add_way(Index v, const Push& push, double beyond, double sign, std::vector<Vec3>& way,
               std::vector<double>& count) const {
    if (!goes(v, beyond)) return;
    way[v] += (sign * beyond) * push.direction;
    ++count[v];
  }

  // As far as it may go, or less where that would spoil a triangle.
  bool move(Index v, Vec3 way) {
    const Vec3 from = mesh_.vertices[v];
    for (int half = 0; half <= kHalvings; ++half, way = 0.5 * way) {
      Vec3 off = from + way - start_[v];
      const double most = kFarthest * length_[v], length = norm(off);
      if (length > most) off = (most / length) * off;
      mesh_.vertices[v] = start_[v] + off;
      if (mesh_.vertices[v] == from) return false;
      if (std::all_of(at_[v].begin(), at_[v].end(), [&](Index t) { return is_good(t); })) return true;
    }
    mesh_.vertices[v] = from;
    return false;
  }

  bool is_good(Index t) const {
    const Triangle& v = mesh_.triangles[t];
    return least_angle(mesh_, v) >= angle_[t] && dot(normal_of(v), normal_[t]) >= kTurned;
  }

  TriangleMesh mesh_;
  std::vector<char> movable_;
  const Context& context_;
  const std::vector<Vec3> start_;
  std::vector<std::vector<Index>> at_;  // triangles of each vertex
  std::vector<double> length_;          // mean of the edges at a vertex
  std::vector<double> angle_;           // of each triangle: what its least angle has to be
  std::vector<Vec3> normal_;            // of each triangle, before
};

}  // namespace

bool push_apart(TriangleMesh& mesh, const std::vector<Pair>& pairs, const std::vector<char>& movable,
                std::size_t most_left, const Context& context) {
  if (pairs.empty() || pairs.size() > mesh.vertices.size() / kVerticesPerPair) return false;
  Part part = part_of(mesh, triangles_around(mesh, pairs), movable);
  const std::vector<Vec3> pushed = PushApart(std::move(part.mesh), std::move(part.movable), context).run();
  std::vector<Vec3> before = mesh.vertices;
  for (std::size_t v = 0; v < pushed.size(); ++v) mesh.vertices[part.vertices[v]] = pushed[v];
  const std::size_t left = count_self_intersections(mesh, context);
  if (left < pairs.size() && left <= most_left) return true;
  mesh.vertices = std::move(before);
  return false;
}

}  // namespace bisector
