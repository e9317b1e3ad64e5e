#include "features/planar_reduction.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/grouping.h"
#include "core/parallel.h"
#include "mesh/stars.h"

namespace bisector {
namespace {

// Of the largest coordinate: how far rounding to six digits moves one.
constexpr double kRounding = 5e-7;
// Neighbours whose normals differ by more are never flat, in radians, however small they are.
constexpr double kMostTilt = 0.01;
// Doubled area over the square of the longest edge: triangles that come about have more, or as much as those they take
// the place of.
constexpr double kLeastAspect = 0.02;
// Triangles at a vertex, at most.
constexpr std::size_t kMostAtVertex = 64;

double aspect_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double longest = std::max({norm2(b - a), norm2(c - b), norm2(a - c)});
  return longest > 0 ? norm(twice_area_normal(a, b, c)) / longest : 0;
}

}  // namespace

class PlanarReduction::Work {
 public:
  Work(PlanarReduction& out, const std::vector<Vec3>& points, const std::vector<std::int32_t>& labels,
       const std::vector<std::array<Index, 2>>& kept)
      : out_(out), points_(points), labels_(labels) {
    double largest = 0;
    for (const Vec3& p : points) largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    rounding_ = kRounding * largest;
    const std::vector<Triangle>& triangles = out.triangles;
    planes_.resize(triangles.size());
    parallel_each(triangles.size(), [&](std::size_t t) { planes_[t] = plane_of(triangles[t]); });
    fixed_.assign(points.size(), 0);
    for (const auto& edge : kept)
      for (const Index v : edge)
        if (v < fixed_.size()) fixed_[v] = 1;
  }

  void run() {
    const std::size_t n = points_.size();
    const Csr<Index> at_vertex = items_at_vertices<Index>(out_.triangles, n);
    std::vector<char> queued(n, 0);
    parallel_each(n, [&](std::size_t v) {
      std::vector<Spoke> spokes;
      queued[v] = can_go(static_cast<Index>(v), std::span{at_vertex.begin(v), at_vertex.end(v)}, spokes);
    });
    std::vector<Index> queue;
    for (Index v = 0; v < n; ++v)
      if (queued[v]) queue.push_back(v);
    if (queue.empty()) return;
    around_.resize(n);
    for (Index v = 0; v < n; ++v) around_[v].assign(at_vertex.begin(v), at_vertex.end(v));
    std::vector<char> gone(out_.triangles.size(), 0);
    std::vector<Spoke> spokes;
    for (std::size_t head = 0; head < queue.size(); ++head) {
      const Index v = queue[head];
      queued[v] = 0;
      if (!can_go(v, around_[v], spokes)) continue;
      const Index to = best_target(v, spokes);
      if (to == kNone) continue;
      collapse(v, to, spokes, gone);
      for (const Spoke& spoke : spokes)
        if (!std::exchange(queued[spoke.end], 1)) queue.push_back(spoke.end);
    }
    std::size_t left = 0;
    for (std::size_t t = 0; t < gone.size(); ++t) {
      if (gone[t]) continue;
      out_.triangles[left] = out_.triangles[t];
      out_.origin[left++] = out_.origin[t];
    }
    out_.triangles.resize(left);
    out_.origin.resize(left);
  }

 private:
  struct Plane {
    Vec3 normal;      // unit, or zero
    double tilt = 0;  // by which rounding may turn it, in radians
  };

  // An edge at a vertex.
  struct Spoke {
    Index end;
    Index leaving = kNone, arriving = kNone;  // triangles that run along it from the vertex, and to it
    unsigned triangles = 0;
    bool marked = false;  // the surface folds or ends there
  };

  Plane plane_of(const Triangle& t) const {
    const Vec3 &a = points_[t[0]], &b = points_[t[1]], &c = points_[t[2]];
    const double longest = std::sqrt(std::max({norm2(b - a), norm2(c - b), norm2(a - c)}));
    if (!(longest > 0) || collinear(a, b, c)) return {};
    const Vec3 n = cross((1 / longest) * (b - a), (1 / longest) * (c - a));
    const double aspect = norm(n);
    if (!std::isnormal(aspect)) return {};
    return {(1 / aspect) * n, 2 * rounding_ / (aspect * longest)};
  }

  bool coplanar(Index s, Index t) const {
    const Plane &p = planes_[s], &q = planes_[t];
    return dot(p.normal, q.normal) > 0 && norm(cross(p.normal, q.normal)) <= std::min(kMostTilt, p.tilt + q.tilt);
  }

  // Whether the surface around v is flat, or folds or ends along one straight line through it.
  bool can_go(Index v, std::span<const Index> around, std::vector<Spoke>& spokes) const {
    spokes.clear();
    if (fixed_[v] || around.size() > kMostAtVertex) return false;
    const auto spoke_to = [&](Index end) -> Spoke& {
      for (Spoke& spoke : spokes)
        if (spoke.end == end) return spoke;
      return spokes.emplace_back(Spoke{end});
    };
    for (const Index t : around) {
      if (planes_[t].normal == Vec3{}) return false;
      const Triangle& w = out_.triangles[t];
      const int m = w[0] == v ? 0 : w[1] == v ? 1 : 2;
      Spoke& first = spoke_to(w[(m + 1) % 3]);
      first.leaving = t;
      ++first.triangles;
      Spoke& last = spoke_to(w[(m + 2) % 3]);
      last.arriving = t;
      ++last.triangles;
    }
    const Spoke* line[2] = {nullptr, nullptr};
    std::size_t count = 0;
    for (Spoke& spoke : spokes) {
      const Index s = spoke.leaving, t = spoke.arriving;
      spoke.marked = spoke.triangles != 2 || s == kNone || t == kNone || !coplanar(s, t) || label(s) != label(t);
      if (!spoke.marked) continue;
      if (count == 2) return false;
      line[count++] = &spoke;
    }
    if (count == 0) return !spokes.empty();
    if (count == 1) return false;
    const Vec3 &p = points_[v], &a = points_[line[0]->end], &b = points_[line[1]->end];
    return dot(a - p, b - p) < 0 && norm(p - nearest_on_segment(p, a, b)) <= 2 * rounding_;
  }
  std::int32_t label(Index t) const { return labels_.empty() ? 0 : labels_[out_.origin[t]]; }

  // Where v may go along one of its spokes: that which leaves the best triangles; kNone if none does.
  Index best_target(Index v, const std::vector<Spoke>& spokes) const {
    const bool on_line = std::any_of(spokes.begin(), spokes.end(), [](const Spoke& s) { return s.marked; });
    double worst_now = 1;
    for (const Index t : around_[v]) {
      const Triangle& w = out_.triangles[t];
      worst_now = std::min(worst_now, aspect_of(points_[w[0]], points_[w[1]], points_[w[2]]));
    }
    Index best = kNone;
    double best_worst = 0;
    for (const Spoke& spoke : spokes) {
      if (on_line && !spoke.marked) continue;
      const double worst = worst_after(v, spoke, spokes);
      if (worst >= std::min(kLeastAspect, worst_now) && worst > best_worst) {
        best_worst = worst;
        best = spoke.end;
      }
    }
    return best;
  }

  // The least aspect of the triangles at v, with v moved along a spoke; 0 if the surface would not stay what it is.
  double worst_after(Index v, const Spoke& spoke, const std::vector<Spoke>& spokes) const {
    const Index to = spoke.end;
    if (around_[to].size() + around_[v].size() > kMostAtVertex) return 0;
    // Both ends may have no other neighbours in common than the triangles between them have.
    std::size_t shared = 0;
    for (const Spoke& other : spokes) {
      if (other.end == to) continue;
      shared += std::any_of(around_[to].begin(), around_[to].end(), [&](Index t) {
        const Triangle& w = out_.triangles[t];
        return std::find(w.begin(), w.end(), other.end) != w.end();
      });
    }
    if (shared != spoke.triangles) return 0;
    const Vec3 &from = points_[v], &target = points_[to];
    const double moved = norm(target - from);
    double worst = 1;
    for (const Index t : around_[v]) {
      const Triangle& w = out_.triangles[t];
      if (std::find(w.begin(), w.end(), to) != w.end()) continue;
      const Plane& plane = planes_[t];
      if (std::abs(dot(target - from, plane.normal)) > 2 * rounding_ + std::min(kMostTilt, plane.tilt) * moved)
        return 0;
      Vec3 p[3];
      for (int k = 0; k < 3; ++k) p[k] = w[k] == v ? target : points_[w[k]];
      if (!(dot(twice_area_normal(p[0], p[1], p[2]), plane.normal) > 0)) return 0;
      worst = std::min(worst, aspect_of(p[0], p[1], p[2]));
    }
    return worst;
  }

  void collapse(Index v, Index to, const std::vector<Spoke>& spokes, std::vector<char>& gone) {
    Chains& chains = out_.chains_;
    for (const Spoke& spoke : spokes) {
      if (!spoke.marked || spoke.end == to) continue;
      std::vector<Index> inner = chain_of(chains, to, v);
      const std::vector<Index> rest = chain_of(chains, v, spoke.end);
      inner.erase(inner.begin());
      inner.insert(inner.end(), rest.begin() + 1, rest.end() - 1);
      if (to > spoke.end) std::reverse(inner.begin(), inner.end());
      chains.erase(edge_key(to, v));
      chains.erase(edge_key(v, spoke.end));
      chains[edge_key(to, spoke.end)] = std::move(inner);
    }
    for (const Index t : around_[v]) {
      Triangle& w = out_.triangles[t];
      if (std::find(w.begin(), w.end(), to) == w.end()) {
        *std::find(w.begin(), w.end(), v) = to;
        around_[to].push_back(t);
        continue;
      }
      gone[t] = 1;
      for (const Index corner : w)
        if (corner != v) std::erase(around_[corner], t);
    }
    around_[v] = {};
  }

  PlanarReduction& out_;
  const std::vector<Vec3>& points_;
  const std::vector<std::int32_t>& labels_;
  double rounding_ = 0;
  std::vector<Plane> planes_;  // of the triangles, as they were
  std::vector<char> fixed_;
  std::vector<std::vector<Index>> around_;  // triangles at each vertex
};

PlanarReduction::PlanarReduction(const std::vector<Vec3>& points, const std::vector<Triangle>& all,
                                 const std::vector<std::int32_t>& labels, const std::vector<std::array<Index, 2>>& kept)
    : triangles(all), origin(all.size()) {
  for (Index t = 0; t < origin.size(); ++t) origin[t] = t;
  Work(*this, points, labels, kept).run();
}

std::vector<Index> PlanarReduction::chain(Index a, Index b) const { return chain_of(chains_, a, b); }

std::vector<Index> PlanarReduction::chain_of(const Chains& chains, Index a, Index b) {
  std::vector<Index> all{a};
  if (const auto inner = chains.find(edge_key(a, b)); inner != chains.end())
    all.insert(all.end(), inner->second.begin(), inner->second.end());
  if (a > b) std::reverse(all.begin() + 1, all.end());
  all.push_back(b);
  return all;
}

}  // namespace bisector
