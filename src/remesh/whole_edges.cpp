#include "remesh/whole_edges.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <numbers>
#include <numeric>
#include <set>
#include <utility>

#include "core/geometry.h"
#include "mesh/stars.h"
#include "mesh/topology.h"
#include "remesh/improve_patch.h"

namespace bisector {
namespace {

// Sweeps of flips and moves over what lies around an edge, and how far that reaches, in edges.
constexpr int kSweeps = 6, kRings = 3;
// Steps of a vertex's move, in shares of its mean edge length, and the directions that are tried.
constexpr double kFirstStep = 0.25, kLeastStep = 0.02;
constexpr int kDirections = 6;
// What a triangle's normal may turn by when it changes: less than a right angle.
constexpr double kLeastCosine = 0.2;
// Radians: an angle below the first makes a sliver, one below the second costs. Rounds over all slivers, and how far
// around one angles are looked at, in edges.
constexpr double kSliver = std::numbers::pi / 6, kCheap = std::numbers::pi / 5;
constexpr int kRounds = 4, kPatchRings = 3, kPatchSweeps = 3;
constexpr double kBetter = 0.98;  // of what the angles around cost: a change that brings less is not made
// Polygons of more corners are not filled anew: the time goes with the cube.
constexpr std::size_t kMostCorners = 64;

using Edge = std::array<Index, 2>;

bool has(const Triangle& t, Index v) { return t[0] == v || t[1] == v || t[2] == v; }
bool faces_the_same_way(const Vec3& a, const Vec3& b) { return dot(a, b) > kLeastCosine * norm(a) * norm(b); }

// At p, in radians.
double angle_at(const Vec3& p, const Vec3& q, const Vec3& r) {
  return std::atan2(norm(cross(q - p, r - p)), dot(q - p, r - p));
}

class Mender {
 public:
  Mender(TriangleMesh& mesh, WholeEdgesOptions& options)
      : mesh_(mesh), options_(options), stars_(mesh.vertices.size()), alive_(mesh.triangles.size(), 1) {
    for (const auto& [a, b] : options.locked) locked_.insert(sorted_edge(a, b));
    for (Index t = 0; t < mesh.triangles.size(); ++t)
      for (const Index v : mesh.triangles[t]) stars_[v].push_back(t);
  }

  void take_out_inner(VertexChain chain) {
    near_.insert(near_.end(), {chain.front(), chain.back()});
    if (chain.size() == 2) {
      locked_.insert(sorted_edge(chain.front(), chain.back()));
      return;
    }
    touched_.insert(touched_.end(), chain.begin(), chain.end());
    for (bool any = true; any && chain.size() > 2;) {
      any = false;
      for (std::size_t k = 1; k + 1 < chain.size();) {
        if (!take_out_of(chain[k - 1], chain[k], chain[k + 1]) && !make_room(chain[k - 1], chain[k], chain[k + 1])) {
          ++k;
          continue;
        }
        any = true;
        if (stars_[chain[k]].empty()) chain.erase(chain.begin() + static_cast<std::ptrdiff_t>(k));
      }
    }
    for (std::size_t k = 0; k + 1 < chain.size(); ++k) locked_.insert(sorted_edge(chain[k], chain[k + 1]));
  }

  void improve() { improve(ring(touched_, kRings), kSweeps); }

  // Flips and moves over these vertices.
  void improve(const std::vector<Index>& near, int sweeps) {
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      for (const Index v : near) flip_at(v);
      for (const Index v : near)
        if (options_.movable[v]) move(v);
    }
    for (const Index v : near) flip_at(v);
  }

  void mend_slivers();

  void drop_dead() {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < alive_.size(); ++t) {
      if (!alive_[t]) continue;
      mesh_.triangles[kept] = mesh_.triangles[t];
      if (!mesh_.labels.empty()) mesh_.labels[kept] = mesh_.labels[t];
      ++kept;
    }
    mesh_.triangles.resize(kept);
    if (!mesh_.labels.empty()) mesh_.labels.resize(kept);
  }

 private:
  const Vec3& at(Index v) const { return mesh_.vertices[v]; }
  Vec3 normal(const Triangle& t) const { return cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0])); }
  double smallest_angle(const Triangle& t) const {
    const Vec3 &a = at(t[0]), &b = at(t[1]), &c = at(t[2]);
    return std::min({angle_at(a, b, c), angle_at(b, c, a), angle_at(c, a, b)});
  }

  std::vector<Index> neighbours(Index v) const { return neighbours_in_star(mesh_.triangles, stars_[v], v); }

  std::vector<Index> ring(std::vector<Index> from, int rings) const {
    for (int k = 0; k < rings; ++k) {
      std::vector<Index> next = from;
      for (const Index v : from) {
        const std::vector<Index> around = neighbours(v);
        next.insert(next.end(), around.begin(), around.end());
      }
      std::sort(next.begin(), next.end());
      next.erase(std::unique(next.begin(), next.end()), next.end());
      from = std::move(next);
    }
    std::erase_if(from, [&](Index v) { return stars_[v].empty(); });
    return from;
  }

  bool are_neighbours(Index a, Index b) const {
    if (apart_.contains(sorted_edge(a, b))) return true;
    return std::any_of(stars_[a].begin(), stars_[a].end(), [&](Index t) { return has(mesh_.triangles[t], b); });
  }
  std::vector<Index> triangles_at(Index a, Index b) const {
    std::vector<Index> found;
    for (const Index t : stars_[a])
      if (has(mesh_.triangles[t], b)) found.push_back(t);
    return found;
  }

  // A fan of the triangles at a vertex, and the vertices along its rim in the sense of the triangles.
  struct Fan {
    std::vector<Index> triangles, rim;
  };

  // The fan from one neighbour of v on, up to `to` if that is met, else all around; empty if triangles do not run in
  // one sense.
  Fan fan(Index v, Index from, Index to) const {
    Fan found;
    found.rim.push_back(from);
    for (std::size_t step = 0; step < stars_[v].size(); ++step) {
      const auto next = std::find_if(stars_[v].begin(), stars_[v].end(), [&](Index t) {
        const Triangle& corners = mesh_.triangles[t];
        for (std::size_t k = 0; k < 3; ++k)
          if (corners[k] == v && corners[(k + 1) % 3] == found.rim.back()) return true;
        return false;
      });
      if (next == stars_[v].end()) return {};
      const Triangle& corners = mesh_.triangles[*next];
      const auto k = static_cast<std::size_t>(std::find(corners.begin(), corners.end(), v) - corners.begin());
      found.triangles.push_back(*next);
      found.rim.push_back(corners[(k + 2) % 3]);
      if (found.rim.back() == to) return found;
    }
    return {};
  }

  // Triangles of the polygon, which runs around counter-clockwise seen against `up`; empty if there are none that are
  // sound. The last corner is joined to the first.
  std::vector<Triangle> triangulate(const std::vector<Index>& polygon, const Vec3& up) const {
    const std::size_t n = polygon.size();
    if (n < 3 || n > kMostCorners) return {};
    std::vector<Index> distinct = polygon;
    std::sort(distinct.begin(), distinct.end());
    if (std::adjacent_find(distinct.begin(), distinct.end()) != distinct.end()) return {};
    // The best smallest angle of the part from i to j, and the corner that its triangle on (i, j) has.
    std::vector<double> best(n * n, -1);
    std::vector<std::size_t> apex(n * n, 0);
    for (std::size_t i = 0; i + 1 < n; ++i) best[i * n + i + 1] = std::numbers::pi;
    for (std::size_t width = 2; width < n; ++width)
      for (std::size_t i = 0; i + width < n; ++i) {
        const std::size_t j = i + width;
        const bool inside = width + 1 < n;
        if (inside && are_neighbours(polygon[i], polygon[j])) continue;
        for (std::size_t k = i + 1; k < j; ++k) {
          const double parts = std::min(best[i * n + k], best[k * n + j]);
          if (parts <= best[i * n + j]) continue;
          const Triangle t{polygon[i], polygon[k], polygon[j]};
          if (!faces_the_same_way(normal(t), up)) continue;
          const double angle = std::min(parts, smallest_angle(t));
          if (angle <= best[i * n + j]) continue;
          best[i * n + j] = angle;
          apex[i * n + j] = k;
        }
      }
    std::vector<Triangle> found;
    if (!(best[n - 1] > 0)) return found;
    std::vector<std::array<std::size_t, 2>> open{{0, n - 1}};
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      if (j < i + 2) continue;
      const std::size_t k = apex[i * n + j];
      found.push_back({polygon[i], polygon[k], polygon[j]});
      open.push_back({i, k});
      open.push_back({k, j});
    }
    return found;
  }

  Vec3 up_of(const Fan& fan) const {
    Vec3 up{};
    for (const Index t : fan.triangles) up += normal(mesh_.triangles[t]);
    return up;
  }

  void replace(const Fan& fan, const std::vector<Triangle>& triangles) {
    for (const Index t : fan.triangles) {
      alive_[t] = 0;
      for (const Index v : mesh_.triangles[t]) std::erase(stars_[v], t);
    }
    for (const Triangle& t : triangles) {
      const auto added = static_cast<Index>(mesh_.triangles.size());
      mesh_.triangles.push_back(t);
      if (!mesh_.labels.empty()) mesh_.labels.push_back(std::int32_t{mesh_.labels[fan.triangles.front()]});
      alive_.push_back(1);
      for (const Index v : t) stars_[v].push_back(added);
    }
  }

  // Takes a vertex out of the edge between two others, on one or both sides of it.
  bool take_out_of(Index from, Index v, Index to) {
    std::vector<Fan> fans;
    std::vector<std::vector<Triangle>> filled;
    std::size_t covered = 0;
    for (const auto& [start, end] : {std::pair{from, to}, {to, from}}) {
      Fan side = fan(v, start, end);
      if (side.triangles.empty()) continue;
      covered += side.triangles.size();
      filled.push_back(triangulate(side.rim, up_of(side)));
      // Both sides share the new edge alone.
      if (filled.back().empty() || are_neighbours(from, to)) return false;
      fans.push_back(std::move(side));
    }
    if (covered == 0 || covered != stars_[v].size()) return false;
    for (std::size_t k = 0; k < fans.size(); ++k) replace(fans[k], filled[k]);
    locked_.erase(sorted_edge(from, v));
    locked_.erase(sorted_edge(v, to));
    locked_.insert(sorted_edge(from, to));
    return true;
  }

  bool take_out(Index v) {
    const std::vector<Index> around = neighbours(v);
    if (around.empty()) return false;
    Fan whole = fan(v, around.front(), around.front());
    if (whole.triangles.size() != stars_[v].size()) return false;
    whole.rim.pop_back();
    const std::vector<Triangle> filled = triangulate(whole.rim, up_of(whole));
    if (filled.empty()) return false;
    replace(whole, filled);
    return true;
  }

  // Takes a movable vertex out that is in the way of the edge between two others: the nearest one to it, by the angle
  // that it sees the edge at.
  bool make_room(Index from, Index v, Index to) {
    std::vector<std::pair<double, Index>> in_the_way;
    for (const Index w : ring({from, v, to}, 1)) {
      if (!options_.movable[w]) continue;
      const double angle = angle_at(at(w), at(from), at(to));
      if (angle > 0.5 * std::numbers::pi) in_the_way.push_back({-angle, w});
    }
    std::sort(in_the_way.begin(), in_the_way.end());
    return std::any_of(in_the_way.begin(), in_the_way.end(), [&](const auto& w) { return take_out(w.second); });
  }

  // The vertex of a triangle beyond its edge.
  Index apex(Index t, Index a, Index b) const {
    for (const Index v : mesh_.triangles[t])
      if (v != a && v != b) return v;
    return kNone;
  }

  // False if the edge is locked or the flip would fold or double the surface.
  bool flip(Index a, Index b) {
    if (locked_.contains(sorted_edge(a, b))) return false;
    const std::vector<Index> both = triangles_at(a, b);
    if (both.size() != 2) return false;
    Index left = both[0], right = both[1];
    const auto runs = [&](Index t) {
      const Triangle& v = mesh_.triangles[t];
      for (std::size_t k = 0; k < 3; ++k)
        if (v[k] == a && v[(k + 1) % 3] == b) return true;
      return false;
    };
    if (!runs(left)) std::swap(left, right);
    if (!runs(left) || runs(right)) return false;
    if (!mesh_.labels.empty() && mesh_.labels[left] != mesh_.labels[right]) return false;
    const Index c = apex(left, a, b), d = apex(right, a, b);
    if (c == d || are_neighbours(c, d)) return false;
    const Vec3 up = normal(mesh_.triangles[left]) + normal(mesh_.triangles[right]);
    const Triangle first{a, d, c}, second{d, b, c};
    if (!faces_the_same_way(up, normal(first)) || !faces_the_same_way(up, normal(second))) return false;
    mesh_.triangles[left] = first;
    mesh_.triangles[right] = second;
    std::erase(stars_[b], left);
    std::erase(stars_[a], right);
    stars_[d].push_back(left);
    stars_[c].push_back(right);
    return true;
  }

  // Makes the edges at a vertex Delaunay: opposite angles sum up to no more than half a turn.
  void flip_at(Index v) {
    for (const Index w : neighbours(v)) {
      const std::vector<Index> both = triangles_at(v, w);
      if (both.size() != 2) continue;
      const auto opposite = [&](Index t) { return angle_at(at(apex(t, v, w)), at(v), at(w)); };
      if (opposite(both[0]) + opposite(both[1]) > std::numbers::pi + 1e-9) flip(v, w);
    }
  }

  double least_angle_at(Index v) const {
    double least = std::numbers::pi;
    for (const Index t : stars_[v]) least = std::min(least, smallest_angle(mesh_.triangles[t]));
    return least;
  }

  // To where the smallest angle around is larger, by trial.
  void move(Index v) {
    if (stars_[v].empty()) return;
    std::vector<Vec3> normals;
    Vec3 up{};
    for (const Index t : stars_[v]) normals.push_back(normal(mesh_.triangles[t]));
    for (const Vec3& n : normals) up += n;
    const std::vector<Index> around = neighbours(v);
    double length = 0;
    for (const Index w : around) length += norm(at(w) - at(v)) / static_cast<double>(around.size());
    const Vec3 y = cross(up, at(around.front()) - at(v)), x = cross(y, up);
    if (!(norm(x) > 0 && norm(y) > 0)) return;
    const Vec3 across = (1 / norm(x)) * x, along = (1 / norm(y)) * y;
    double best = least_angle_at(v);
    for (double step = kFirstStep; step > kLeastStep; step /= 2)
      for (int k = 0; k < kDirections; ++k) {
        const double turn = 2 * std::numbers::pi * k / kDirections;
        const Vec3 before = at(v);
        mesh_.vertices[v] =
            options_.project(before + step * length * (std::cos(turn) * along + std::sin(turn) * across));
        bool turns = false;
        for (std::size_t i = 0; i < normals.size() && !turns; ++i)
          turns = !faces_the_same_way(normals[i], normal(mesh_.triangles[stars_[v][i]]));
        const double angle = turns ? -1 : least_angle_at(v);
        if (angle > best) best = angle;
        else mesh_.vertices[v] = before;
      }
  }

  // Puts a vertex into the edge between two others; false if it is locked, or no edge of two triangles.
  bool split(Index a, Index b) {
    if (locked_.contains(sorted_edge(a, b))) return false;
    const std::vector<Index> both = triangles_at(a, b);
    if (both.size() != 2) return false;
    const Index m = add_vertex(0.5 * (at(a) + at(b)));
    for (const Index t : both) {
      Triangle first = mesh_.triangles[t], second = first;
      std::replace(first.begin(), first.end(), b, m);
      std::replace(second.begin(), second.end(), a, m);
      replace({{t}, {}}, {first, second});
    }
    return true;
  }

  void insert(Index t) {
    const auto [a, b, c] = mesh_.triangles[t];
    const Index m = add_vertex((1.0 / 3) * (at(a) + at(b) + at(c)));
    replace({{t}, {}}, {{a, b, m}, {b, c, m}, {c, a, m}});
  }

  Index add_vertex(const Vec3& p) {
    mesh_.vertices.push_back(options_.project(p));
    stars_.emplace_back();
    options_.movable.push_back(1);
    return static_cast<Index>(mesh_.vertices.size() - 1);
  }

  // Whether two locked edges enclose the smallest angle.
  bool is_imposed(const Triangle& t) const {
    const std::array<Vec3, 3> corners{at(t[0]), at(t[1]), at(t[2])};
    std::array<bool, 3> locked{};
    for (std::size_t k = 0; k < 3; ++k) locked[k] = locked_.contains(sorted_edge(t[k], t[(k + 1) % 3]));
    return angle_is_imposed(corners, locked);
  }

  bool is_sliver(Index t) const {
    return alive_[t] && smallest_angle(mesh_.triangles[t]) < kSliver && !is_imposed(mesh_.triangles[t]);
  }

  // By the angles that are too small, the least of them counting most.
  double cost() const {
    double sum = 0;
    for (Index t = 0; t < mesh_.triangles.size(); ++t) {
      if (!alive_[t] || is_imposed(mesh_.triangles[t])) continue;
      const double under = std::max(0.0, kCheap - smallest_angle(mesh_.triangles[t]));
      sum += under * under * under;
    }
    return sum;
  }

  struct Patch;
  Patch patch_around(Index t) const;
  void take(const Patch& patch);
  bool mend(Index t);

  TriangleMesh& mesh_;
  WholeEdgesOptions& options_;
  std::set<Edge> locked_;
  std::set<Edge> apart_;                   // vertices that are neighbours outside of the mesh
  std::vector<std::vector<Index>> stars_;  // triangles at each vertex
  std::vector<char> alive_;                // of the triangles
  std::vector<Index> touched_;             // of chains that were divided
  std::vector<Index> near_;                // ends of all chains
};

// What lies around a sliver, with vertices of its own, to try changes on.
struct Mender::Patch {
  TriangleMesh mesh;
  WholeEdgesOptions options;
  std::set<Edge> apart;
  std::vector<Index> vertices, triangles;  // what they are in the whole mesh; none for those added
  Index sliver = 0;
};

Mender::Patch Mender::patch_around(Index t) const {
  Patch patch;
  const Triangle& corners = mesh_.triangles[t];
  patch.vertices = ring({corners.begin(), corners.end()}, kPatchRings);
  const auto place = [&](Index v) {
    const auto found = std::lower_bound(patch.vertices.begin(), patch.vertices.end(), v);
    return found == patch.vertices.end() || *found != v ? kNone : static_cast<Index>(found - patch.vertices.begin());
  };
  for (const Index v : patch.vertices) {
    patch.mesh.vertices.push_back(at(v));
    bool inside = true;
    for (const Index star : stars_[v]) {
      Triangle local = mesh_.triangles[star];
      for (Index& w : local) w = place(w);
      const bool whole = std::find(local.begin(), local.end(), kNone) == local.end();
      inside = inside && whole;
      if (!whole || mesh_.triangles[star][0] != v) continue;
      if (star == t) patch.sliver = static_cast<Index>(patch.mesh.triangles.size());
      patch.triangles.push_back(star);
      patch.mesh.triangles.push_back(local);
      if (!mesh_.labels.empty()) patch.mesh.labels.push_back(mesh_.labels[star]);
    }
    patch.options.movable.push_back(inside && options_.movable[v]);
  }
  for (const Index v : patch.vertices)
    for (const Index w : neighbours(v)) {
      const Index a = place(v), b = place(w);
      if (b == kNone || b < a) continue;
      if (locked_.contains(sorted_edge(v, w))) patch.options.locked.push_back({a, b});
      patch.apart.insert({a, b});
    }
  for (const Triangle& local : patch.mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) patch.apart.erase(sorted_edge(local[k], local[(k + 1) % 3]));
  patch.options.project = options_.project;
  return patch;
}

// In place of what the whole mesh has there.
void Mender::take(const Patch& patch) {
  for (const Index t : patch.triangles) {
    alive_[t] = 0;
    for (const Index v : mesh_.triangles[t]) std::erase(stars_[v], t);
  }
  std::vector<Index> name = patch.vertices;
  for (std::size_t v = 0; v < patch.mesh.vertices.size(); ++v) {
    if (v >= name.size()) name.push_back(add_vertex(patch.mesh.vertices[v]));
    mesh_.vertices[name[v]] = patch.mesh.vertices[v];
  }
  for (std::size_t i = 0; i < patch.mesh.triangles.size(); ++i) {
    Triangle t = patch.mesh.triangles[i];
    for (Index& v : t) v = name[v];
    const auto added = static_cast<Index>(mesh_.triangles.size());
    mesh_.triangles.push_back(t);
    if (!mesh_.labels.empty()) mesh_.labels.push_back(patch.mesh.labels[i]);
    alive_.push_back(1);
    for (const Index v : t) stars_[v].push_back(added);
  }
}

// The best of all changes to the sliver and what is beside it, if one is better than none.
bool Mender::mend(Index t) {
  const Patch given = patch_around(t);
  const Triangle& corners = given.mesh.triangles[given.sliver];
  Patch as_it_is = given;
  const Mender before(as_it_is.mesh, as_it_is.options);
  double least = kBetter * before.cost();
  Patch best;
  const auto attempt = [&](const std::function<bool(Mender&)>& change) {
    Patch patch = given;
    Mender mender(patch.mesh, patch.options);
    mender.apart_ = given.apart;
    if (!change(mender)) return;
    std::vector<Index> all(patch.mesh.vertices.size());
    std::iota(all.begin(), all.end(), Index{0});
    std::erase_if(all, [&](Index v) { return mender.stars_[v].empty(); });
    mender.improve(all, kPatchSweeps);
    const double now = mender.cost();
    if (now >= least) return;
    least = now;
    mender.drop_dead();
    best = std::move(patch);
  };
  attempt([](Mender&) { return true; });
  for (const Index v : before.ring({corners.begin(), corners.end()}, 1))
    if (given.options.movable[v]) attempt([v](Mender& mender) { return mender.take_out(v); });
  for (std::size_t k = 0; k < 3; ++k)
    attempt([&, k](Mender& mender) { return mender.split(corners[k], corners[(k + 1) % 3]); });
  attempt([&](Mender& mender) {
    mender.insert(given.sliver);
    return true;
  });
  if (best.mesh.triangles.empty()) return false;
  take(best);
  return true;
}

void Mender::mend_slivers() {
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::pair<double, Index>> slivers;
    for (const Index v : ring(near_, 1))
      for (const Index t : stars_[v])
        if (is_sliver(t)) slivers.push_back({smallest_angle(mesh_.triangles[t]), t});
    std::sort(slivers.begin(), slivers.end());
    slivers.erase(std::unique(slivers.begin(), slivers.end()), slivers.end());
    bool any = false;
    for (const auto& [angle, t] : slivers)
      if (alive_[t]) any = mend(t) || any;
    if (!any) return;
  }
}

}  // namespace

void make_whole(TriangleMesh& mesh, const std::vector<VertexChain>& chains, WholeEdgesOptions options) {
  Mender mender(mesh, options);
  for (const VertexChain& chain : chains) mender.take_out_inner(chain);
  mender.improve();
  mender.mend_slivers();
  mender.drop_dead();
}

}  // namespace bisector
