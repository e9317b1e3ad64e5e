#include "remesh/push_apart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "mesh/triangle_quality.h"

namespace bisector {
namespace {

using Pair = std::array<Index, 2>;
using Corners = std::array<Vec3, 3>;

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

bool meet(const Box& a, const Box& b) {
  for (int k = 0; k < 3; ++k)
    if (a.hi[k] < b.lo[k] || b.hi[k] < a.lo[k]) return false;
  return true;
}

// The triangles that meet the boxes of those of the pairs, with as much around these as they are large; their vertices
// are all of the mesh's.
TriangleMesh part_around(const TriangleMesh& mesh, const std::vector<Pair>& pairs) {
  std::vector<Index> crossing;
  for (const Pair& pair : pairs) crossing.insert(crossing.end(), pair.begin(), pair.end());
  std::sort(crossing.begin(), crossing.end());
  crossing.erase(std::unique(crossing.begin(), crossing.end()), crossing.end());
  std::vector<Box> boxes;
  for (const Index t : crossing) {
    Box box = bounding_box(mesh.vertices, {mesh.triangles[t]});
    const double around = box.diagonal();
    for (int k = 0; k < 3; ++k) {
      box.lo[k] -= around;
      box.hi[k] += around;
    }
    boxes.push_back(box);
  }
  TriangleMesh part;
  part.vertices = mesh.vertices;
  for (const Triangle& t : mesh.triangles) {
    const Box own = bounding_box(mesh.vertices, {t});
    if (std::any_of(boxes.begin(), boxes.end(), [&](const Box& box) { return meet(own, box); }))
      part.triangles.push_back(t);
  }
  return part;
}

class PushApart {
 public:
  // Only vertices all of whose triangles are in the part move.
  PushApart(TriangleMesh part, const TriangleMesh& mesh, std::vector<char> movable, const Context& context)
      : mesh_(std::move(part)), movable_(std::move(movable)), context_(context), start_(mesh_.vertices),
        at_(mesh_.vertices.size()), length_(mesh_.vertices.size(), 0) {
    std::vector<std::size_t> triangles(mesh_.vertices.size(), 0);
    for (const Triangle& t : mesh.triangles)
      for (const Index v : t) ++triangles[v];
    std::vector<double> count(mesh_.vertices.size(), 0);
    for (Index t = 0; t < mesh_.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const Index a = mesh_.triangles[t][k], b = mesh_.triangles[t][(k + 1) % 3];
        at_[a].push_back(t);
        const double length = norm(mesh_.vertices[b] - mesh_.vertices[a]);
        for (const Index v : {a, b}) {
          length_[v] += length;
          ++count[v];
        }
      }
    for (std::size_t v = 0; v < length_.size(); ++v) {
      if (count[v] > 0) length_[v] /= count[v];
      movable_[v] = movable_[v] && at_[v].size() == triangles[v];
    }
    for (const Triangle& t : mesh_.triangles) {
      angle_.push_back(std::min(kGoodAngle, least_angle(t)));
      normal_.push_back(normal_of(t));
    }
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
  double least_angle(const Triangle& t) const {
    const auto theta = measure_triangle(mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]]).theta;
    return *std::min_element(theta.begin(), theta.end());
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
    return least_angle(v) >= angle_[t] && dot(normal_of(v), normal_[t]) >= kTurned;
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

std::size_t push_apart(TriangleMesh& mesh, const std::vector<Pair>& pairs, const std::vector<char>& movable,
                       const Context& context) {
  if (pairs.empty() || pairs.size() > mesh.vertices.size() / kVerticesPerPair) return pairs.size();
  std::vector<Vec3> before = mesh.vertices;
  mesh.vertices = PushApart(part_around(mesh, pairs), mesh, movable, context).run();
  const std::size_t left = count_self_intersections(mesh, context);
  if (left < pairs.size()) return left;
  mesh.vertices = std::move(before);
  return pairs.size();
}

}  // namespace bisector
