#include "remesh/improve_patch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/parallel.h"

namespace bisector {
namespace {

using Kind = SeedPlace::Kind;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kAngleWeight = 0.5;                   // of the smallest angle's cosine beside Q
constexpr double kLinear = 10, kQuadratic = 200;       // of what is beyond the goal
constexpr double kMargin = 2;                          // degrees within the goal, from where on it is felt
constexpr double kHold = 6;                            // in a patch, for cells of about equal size
constexpr double kFolded = 20;                         // cost of a triangle that turned over
constexpr double kEncroached = 20;                     // cost of a vertex whose cell cuts a locked edge
constexpr std::size_t kSamples = 5;                    // of a curve between two vertices; one is in the middle
constexpr double kFacing = 0.2;                        // least cosine between a triangle and what it replaces
constexpr double kFirstStep = 0.1, kLastStep = 0.003;  // of the mean edge length
constexpr double kDelaunaySlack = 1e-9;
constexpr int kFlipPasses = 8;
constexpr int kMostCrossed = 16;  // edges in the way of one of a curve
constexpr int kFlipEvery = 3;     // sweeps

double beyond(double excess) { return excess > 0 ? excess * (kLinear + kQuadratic * excess) : 0; }

bool before(const LockedEdge& e, const LockedEdge& f) { return std::pair(e.a, e.b) < std::pair(f.a, f.b); }

std::array<Index, 2> key(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

bool has(const Triangle& t, Index v) { return t[0] == v || t[1] == v || t[2] == v; }

// The corner of t that is neither a nor b.
Index opposite(const Triangle& t, Index a, Index b) {
  for (const Index v : t)
    if (v != a && v != b) return v;
  return kNone;
}

// The lowest point of the parabola through values at -1, 0 and 1, not too far off.
double lowest(double behind, double here, double ahead) {
  const double slope = ahead - behind, bend = ahead + behind - 2 * here;
  constexpr double kFarthest = 1.5;
  return bend > 0 ? std::clamp(-0.5 * slope / bend, -kFarthest, kFarthest) : slope > 0 ? -kFarthest : kFarthest;
}

// Cosines of a triangle's smallest and largest angle, and Q.
struct Shape {
  double smallest, largest, q;
};

Shape shape_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a;
  double s = norm2(u), m = norm2(v), l = norm2(c - b);
  if (s > m) std::swap(s, m);
  if (m > l) std::swap(m, l);
  if (s > m) std::swap(s, m);
  if (!(s > 0)) return {1, -1, 0};
  const double rs = std::sqrt(s), rm = std::sqrt(m), rl = std::sqrt(l);
  return {(m + l - s) / (2 * rm * rl), (s + m - l) / (2 * rs * rm),
          6 / std::numbers::sqrt3 * norm(cross(u, v)) / ((rs + rm + rl) * rl)};
}

double cost_of(const Shape& shape, const ShapeGoal& goal) {
  return (1 - shape.q) + kAngleWeight * (shape.smallest - 0.5) + beyond(shape.smallest - goal.near_min) +
         beyond(goal.near_max - shape.largest);
}

// Most triangles are within the goal by more than its margin, which their cosines tell.
ShapeExcess excess_of(const Shape& shape, const ShapeGoal& goal) {
  const auto angle = [](double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)) * kDegrees; };
  ShapeExcess excess;
  if (!(shape.smallest < goal.near_min)) excess.under = std::max(0.0, goal.min_angle - angle(shape.smallest));
  if (!(shape.largest > goal.near_max)) excess.over = std::max(0.0, angle(shape.largest) - goal.max_angle);
  return excess;
}

}  // namespace

ShapeGoal shape_goal(double min_angle, double max_angle) {
  const auto cosine = [](double degrees) { return std::cos(degrees / kDegrees); };
  return {min_angle, max_angle, cosine(min_angle + kMargin), cosine(max_angle - kMargin)};
}

double shape_cost(const Vec3& a, const Vec3& b, const Vec3& c, const ShapeGoal& goal) {
  return cost_of(shape_of(a, b, c), goal);
}

ShapeExcess shape_excess(const Vec3& a, const Vec3& b, const Vec3& c, const ShapeGoal& goal) {
  return excess_of(shape_of(a, b, c), goal);
}

std::pair<double, ShapeExcess> shape_cost_and_excess(const Vec3& a, const Vec3& b, const Vec3& c,
                                                     const ShapeGoal& goal) {
  const Shape shape = shape_of(a, b, c);
  return {cost_of(shape, goal), excess_of(shape, goal)};
}

bool angle_is_imposed(const std::array<Vec3, 3>& corners, const std::array<bool, 3>& locked) {
  int least = 0;
  std::array<double, 3> squared;
  for (int m = 0; m < 3; ++m) {
    squared[m] = norm2(corners[(m + 1) % 3] - corners[m]);
    if (squared[m] < squared[least]) least = m;
  }
  return locked[(least + 1) % 3] && locked[(least + 2) % 3];
}

double free_angle_lack(const std::array<Vec3, 3>& corners, const std::array<bool, 3>& locked, double degrees) {
  double least = degrees;
  for (int m = 0; m < 3; ++m) {
    if (locked[m] && locked[(m + 2) % 3]) continue;
    const Vec3 u = corners[(m + 1) % 3] - corners[m], v = corners[(m + 2) % 3] - corners[m];
    least = std::min(least, std::atan2(norm(cross(u, v)), dot(u, v)) * kDegrees);
  }
  return degrees - least;
}

SurfacePoint CellMap::foot(const Vec3& p, Index& owner) const {
  double nearest = norm2(seeds_[owner] - p);
  for (Index last = kNone; last != owner;) {
    last = owner;
    for (const Index* j = rings_.begin(last); j != rings_.end(last); ++j) {
      const double squared = norm2(seeds_[*j] - p);
      if (squared < nearest) {
        nearest = squared;
        owner = *j;
      }
    }
  }
  return nearest_on_triangles(surface_, {cells_.begin(owner), cells_.end(owner)}, p);
}

Vec3 CellMap::project(const Vec3& p, Index& owner, Vec3& normal) const {
  const SurfacePoint on = foot(p, owner);
  if (!on.facet) return p;
  normal = on.facet->normal;
  return on.at;
}

Index CellMap::triangle_at(const Vec3& p, Index owner) const {
  const SurfacePoint on = foot(p, owner);
  if (!on.facet) return kNone;
  return surface_.summaries[static_cast<std::size_t>(on.facet - surface_.facets.data())].triangle;
}

CurvesBetween::CurvesBetween(const FeatureCurves& curves) : curves_(curves) {
  at_corner_.resize(curves.graph().corners.size());
  for (Index curve = 0; curve < curves.size(); ++curve)
    for (const Index corner : curves.ends(curve))
      if (corner != kNone) at_corner_[corner].push_back(curve);
}

Index CurvesBetween::operator()(const SeedPlace& u, const SeedPlace& v) const {
  if (u.curve != kNone || v.curve != kNone) {
    const Index curve = u.curve != kNone ? u.curve : v.curve;
    const auto on_it = [&](const SeedPlace& place) {
      const auto [first, last] = curves_.ends(curve);
      return place.curve == curve || (place.corner != kNone && (place.corner == first || place.corner == last));
    };
    return on_it(u) && on_it(v) ? curve : kNone;
  }
  if (u.corner == kNone || v.corner == kNone) return kNone;
  Index found = kNone;
  for (const Index curve : at_corner_[u.corner]) {
    const auto [first, last] = curves_.ends(curve);
    if (first == last || (first != v.corner && last != v.corner)) continue;
    if (found != kNone) return kNone;
    found = curve;
  }
  return found;
}

Index ImprovePatch::add_vertex(const PatchVertex& vertex) {
  vertices_.push_back(vertex);
  stars_.emplace_back();
  return static_cast<Index>(vertices_.size() - 1);
}

ImprovePatch::PatchTriangle ImprovePatch::make_triangle(const Triangle& t) const {
  const Vec3 &a = vertices_[t[0]].x, &b = vertices_[t[1]].x, &c = vertices_[t[2]].x;
  PatchTriangle triangle{t, unit(cross(b - a, c - a)), 0, true};
  triangle.cost = cost_of(triangle);
  return triangle;
}

void ImprovePatch::add_triangle(const Triangle& t) {
  const Index index = static_cast<Index>(triangles_.size());
  triangles_.push_back(make_triangle(t));
  for (const Index v : t) stars_[v].push_back(index);
}

void ImprovePatch::set_mesh(const std::vector<PatchVertex>& vertices, const std::vector<Triangle>& triangles,
                            const Csr<Index>& stars) {
  vertices_ = vertices;
  triangles_.resize(triangles.size());
  parallel_each(triangles.size(), [&](std::size_t t) { triangles_[t] = make_triangle(triangles[t]); });
  stars_.resize(vertices.size());
  parallel_each(vertices.size(), [&](std::size_t v) { stars_[v].assign(stars.begin(v), stars.end(v)); });
}

void ImprovePatch::lock(std::vector<LockedEdge> edges) {
  locked_ = std::move(edges);
  std::sort(locked_.begin(), locked_.end(), before);
  const auto same = [](const LockedEdge& e, const LockedEdge& f) { return !before(e, f) && !before(f, e); };
  locked_.erase(std::unique(locked_.begin(), locked_.end(), same), locked_.end());
}

std::vector<Triangle> ImprovePatch::triangles() const {
  std::vector<Triangle> alive;
  for (const PatchTriangle& t : triangles_)
    if (t.alive) alive.push_back(t.v);
  return alive;
}

double ImprovePatch::cost(double average, double irregular) const {
  return shape_cost_sum(average, irregular) + kEncroached * static_cast<double>(encroachments());
}

ImprovePatch::Lack ImprovePatch::lack(double degrees) const {
  Lack lack;
  for (const PatchTriangle& t : triangles_) {
    if (!t.alive) continue;
    std::array<Vec3, 3> x;
    for (int m = 0; m < 3; ++m) x[m] = vertices_[t.v[m]].x;
    const double under = free_angle_lack(x, locked_edges(t), degrees);
    lack.squares += under * under;
    lack.most = std::max(lack.most, under);
  }
  return lack;
}

std::array<bool, 3> ImprovePatch::locked_edges(const PatchTriangle& t) const {
  std::array<bool, 3> locked;
  for (int m = 0; m < 3; ++m) locked[m] = is_locked(t.v[m], t.v[(m + 1) % 3]);
  return locked;
}

double ImprovePatch::shape_cost_sum(double average, double irregular) const {
  double sum = 0;
  for (const PatchTriangle& t : triangles_)
    if (t.alive) sum += t.cost - average;
  for (Index v = 0; v < vertices_.size(); ++v)
    if (vertices_[v].place.kind == Kind::surface && !vertices_[v].removed)
      sum += irregular * std::abs(excess_degree(v));
  return sum;
}

bool ImprovePatch::is_folded() const {
  return std::any_of(triangles_.begin(), triangles_.end(),
                     [&](const PatchTriangle& t) { return t.alive && turns(t.v, t.facing); });
}

ShapeExcess ImprovePatch::worst() const {
  ShapeExcess worst;
  for (const PatchTriangle& t : triangles_)
    if (t.alive) worst.take(shape_excess(vertices_[t.v[0]].x, vertices_[t.v[1]].x, vertices_[t.v[2]].x, goal_));
  return worst;
}

std::size_t ImprovePatch::encroachments() const {
  std::size_t count = 0;
  for (const LockedEdge& edge : locked_) {
    if (edge.curve == kNone) continue;
    const Vec3 &a = vertices_[edge.a].x, &b = vertices_[edge.b].x;
    const auto [from, to] = stretch(edge);
    std::array<Vec3, kSamples> points;
    std::array<double, kSamples> squared;
    for (std::size_t k = 0; k < kSamples; ++k) {
      const double share = static_cast<double>(k + 1) / (kSamples + 1);
      points[k] = curves_->point(edge.curve, curves_->wrap(edge.curve, from + share * (to - from)));
      squared[k] = std::min(norm2(points[k] - a), norm2(points[k] - b));
    }
    for (Index v = 0; v < vertices_.size(); ++v) {
      if (v == edge.a || v == edge.b || vertices_[v].removed) continue;
      bool cuts = false;
      for (std::size_t k = 0; k < kSamples; ++k) cuts |= norm2(points[k] - vertices_[v].x) < squared[k];
      count += cuts;
    }
  }
  return count;
}

std::array<double, 2> ImprovePatch::stretch(const LockedEdge& edge) const {
  const SeedPlace &u = vertices_[edge.a].place, &v = vertices_[edge.b].place;
  const double length = curves_->length(edge.curve);
  const double on = u.curve == edge.curve ? u.position : v.position;
  const auto position = [&](const SeedPlace& place) {
    if (place.curve == edge.curve) return place.position;
    const auto [first, last] = curves_->ends(edge.curve);
    if (first == last) return on < 0.5 * length ? 0.0 : length;
    return place.corner == first ? 0.0 : length;
  };
  const double from = position(u);
  double to = position(v);
  if (curves_->closed(edge.curve) && to - from > 0.5 * length) to -= length;
  if (curves_->closed(edge.curve) && from - to > 0.5 * length) to += length;
  return {from, to};
}

int ImprovePatch::excess_degree(Index v) const { return static_cast<int>(stars_[v].size() + vertices_[v].outside) - 6; }

bool ImprovePatch::turns(const Triangle& t, const Vec3& facing) const {
  const Vec3& a = vertices_[t[0]].x;
  const Vec3 n = cross(vertices_[t[1]].x - a, vertices_[t[2]].x - a);
  const double along = dot(n, facing);
  return !(facing == Vec3{}) && !(along > 0 && along * along > kFacing * kFacing * norm2(n));
}

double ImprovePatch::cost_of(const PatchTriangle& t) const {
  if (turns(t.v, t.facing)) return kFolded;
  return shape_cost(vertices_[t.v[0]].x, vertices_[t.v[1]].x, vertices_[t.v[2]].x, goal_);
}

double ImprovePatch::star_cost(Index v) const {
  double sum = 0;
  for (const Index t : stars_[v]) sum += cost_of(triangles_[t]);
  return sum;
}

const LockedEdge* ImprovePatch::locked_edge(Index a, Index b) const {
  const LockedEdge edge{std::min(a, b), std::max(a, b), kNone};
  const auto place = std::lower_bound(locked_.begin(), locked_.end(), edge, before);
  return place != locked_.end() && !before(edge, *place) ? &*place : nullptr;
}

void ImprovePatch::set_locked(Index a, Index b, Index curve) {
  const LockedEdge edge{std::min(a, b), std::max(a, b), curve};
  if (!is_locked(a, b)) locked_.insert(std::lower_bound(locked_.begin(), locked_.end(), edge, before), edge);
}

void ImprovePatch::unlock(Index a, Index b) {
  std::erase_if(locked_, [&](const LockedEdge& edge) { return edge.a == std::min(a, b) && edge.b == std::max(a, b); });
}

bool ImprovePatch::triangles_at(Index a, Index b, std::size_t& left, std::size_t& right) const {
  std::size_t count = 0;
  int turned = 0;
  for (const Index t : stars_[a]) {
    const Triangle& v = triangles_[t].v;
    if (!has(v, b)) continue;
    const bool forward = v[0] == a ? v[1] == b : v[1] == a ? v[2] == b : v[0] == b;
    turned += forward ? 1 : -1;
    (forward ? left : right) = t;
    ++count;
  }
  return count == 2 && turned == 0;
}

void ImprovePatch::replace(std::size_t t, const Triangle& corners, const Vec3& facing) {
  PatchTriangle& triangle = triangles_[t];
  for (const Index v : triangle.v)
    if (!has(corners, v)) std::erase(stars_[v], static_cast<Index>(t));
  for (const Index v : corners)
    if (!has(triangle.v, v)) stars_[v].push_back(static_cast<Index>(t));
  triangle.v = corners;
  triangle.facing = facing;
  triangle.cost = cost_of(triangle);
}

void ImprovePatch::kill(std::size_t t) {
  for (const Index v : triangles_[t].v) std::erase(stars_[v], static_cast<Index>(t));
  triangles_[t].alive = false;
}

template <class Facing>
bool ImprovePatch::flip_facing(Index a, Index b, const Facing& facing_of) {
  std::size_t left, right;
  if (is_locked(a, b) || !triangles_at(a, b, left, right)) return false;
  const Index c = opposite(triangles_[left].v, a, b), d = opposite(triangles_[right].v, a, b);
  if (c == d) return false;
  for (const Index t : stars_[c])
    if (has(triangles_[t].v, d)) return false;
  const Vec3 before = unit(triangles_[left].facing + triangles_[right].facing);
  const Triangle one{a, d, c}, two{d, b, c};
  const Vec3 facing_one = facing_of(one, before), facing_two = facing_of(two, before);
  if (turns(one, facing_one) || turns(two, facing_two)) return false;
  replace(left, one, facing_one);
  replace(right, two, facing_two);
  return true;
}

bool ImprovePatch::flip(Index a, Index b) {
  return flip_facing(a, b, [](const Triangle&, const Vec3& before) { return before; });
}

bool ImprovePatch::flip_by_surface(Index a, Index b) {
  return flip_facing(a, b, [&](const Triangle& t, Vec3 facing) {
    const Vec3 middle = (1.0 / 3) * (vertices_[t[0]].x + vertices_[t[1]].x + vertices_[t[2]].x);
    Index owner = vertices_[t[0]].owner;
    if (owner != kNone) map_->project(middle, owner, facing);
    return facing;
  });
}

bool ImprovePatch::crossed_edge(Index from, Index to, std::array<Index, 2>& edge) const {
  // In the plane through the way and the normals around, for triangles that cut a crease have planes of their own.
  const Vec3 &start = vertices_[from].x, way = unit(vertices_[to].x - start);
  Vec3 up{};
  for (const Index t : stars_[from]) up = up + triangles_[t].facing;
  const Vec3 across = cross(up, way);
  double best = 0;
  for (const Index t : stars_[from]) {
    const Triangle& v = triangles_[t].v;
    const int m = v[0] == from ? 0 : v[1] == from ? 1 : 2;
    const Index c = v[(m + 1) % 3], d = v[(m + 2) % 3];
    const double at_c = dot(vertices_[c].x - start, across), at_d = dot(vertices_[d].x - start, across);
    if (!(std::min(at_c, at_d) < 0 && std::max(at_c, at_d) > 0)) continue;
    const double share = at_c / (at_c - at_d);
    const Vec3 crossing = (1 - share) * vertices_[c].x + share * vertices_[d].x;
    const double ahead = dot(unit(crossing - start), way);
    if (!(ahead > best)) continue;
    best = ahead;
    edge = {c, d};
  }
  return best > 0;
}

bool ImprovePatch::flip_on_the_way(Index from, Index to) {
  std::array<Index, 2> edge;
  return crossed_edge(from, to, edge) && flip_by_surface(edge[0], edge[1]);
}

bool ImprovePatch::connect(Index a, Index b, Index curve) {
  for (int flips = 0; flips < kMostCrossed; ++flips) {
    if (std::any_of(stars_[a].begin(), stars_[a].end(), [&](Index t) { return has(triangles_[t].v, b); })) {
      if (is_locked(a, b)) return false;
      set_locked(a, b, curve);
      return true;
    }
    if (!flip_on_the_way(a, b) && !flip_on_the_way(b, a)) return false;
  }
  return false;
}

void ImprovePatch::make_delaunay() {
  bool changed = true;
  for (int pass = 0; pass < kFlipPasses && changed; ++pass) {
    changed = false;
    for (std::size_t k = 0; k < triangles_.size(); ++k)
      for (int m = 0; m < 3 && triangles_[k].alive; ++m) {
        const Index a = triangles_[k].v[m], b = triangles_[k].v[(m + 1) % 3];
        std::size_t left, right;
        if (a > b || !triangles_at(a, b, left, right)) continue;
        double cotangents = 0;
        for (const std::size_t t : {left, right}) {
          const Vec3& apex = vertices_[opposite(triangles_[t].v, a, b)].x;
          const Vec3 u = vertices_[a].x - apex, v = vertices_[b].x - apex;
          const double sine = norm(cross(u, v));
          cotangents += sine > 0 ? dot(u, v) / sine : (dot(u, v) > 0 ? 1e9 : -1e9);
        }
        if (cotangents < -kDelaunaySlack) changed |= flip(a, b);
      }
  }
}

bool ImprovePatch::can_collapse(Index v, Index to) const {
  std::size_t shared = 0, common = 0;
  std::vector<Index> around;
  for (const Index t : stars_[v]) {
    const PatchTriangle& triangle = triangles_[t];
    if (has(triangle.v, to)) {
      ++shared;
      continue;
    }
    Triangle moved = triangle.v;
    for (Index& w : moved)
      if (w == v) w = to;
    if (turns(moved, triangle.facing)) return false;
  }
  for (const Index t : stars_[v])
    for (const Index w : triangles_[t].v)
      if (w != v && w != to && std::find(around.begin(), around.end(), w) == around.end()) around.push_back(w);
  for (const Index w : around)
    for (const Index t : stars_[w])
      if (has(triangles_[t].v, to)) {
        ++common;
        break;
      }
  return shared > 0 && common == shared;
}

bool ImprovePatch::collapse(Index v, Index to) {
  if (!can_collapse(v, to)) return false;
  const std::vector<Index> star = stars_[v];
  for (const Index t : star) {
    if (has(triangles_[t].v, to)) {
      kill(t);
      continue;
    }
    Triangle moved = triangles_[t].v;
    for (Index& w : moved)
      if (w == v) w = to;
    replace(t, moved, triangles_[t].facing);
  }
  return true;
}

bool ImprovePatch::remove(Index v) {
  if (vertices_[v].removed || !vertices_[v].free || vertices_[v].place.corner != kNone) return false;
  const bool surface = vertices_[v].place.kind == Kind::surface;
  std::vector<std::pair<double, Index>> ends;
  std::vector<Index> along;  // its neighbours on the curve
  for (const Index t : stars_[v])
    for (const Index w : triangles_[t].v) {
      if (w == v || std::any_of(ends.begin(), ends.end(), [&](const auto& end) { return end.second == w; })) continue;
      const bool locked = is_locked(v, w);
      if (locked) along.push_back(w);
      if (surface || locked) ends.push_back({norm2(vertices_[w].x - vertices_[v].x), w});
    }
  // The stretches on both sides of it become one.
  if (!surface && (along.size() != 2 || is_locked(along[0], along[1]))) return false;
  std::sort(ends.begin(), ends.end());
  for (const auto& [squared, to] : ends) {
    if (!collapse(v, to)) continue;
    vertices_[v].removed = true;
    for (const Index w : along) unlock(v, w);
    if (!surface) set_locked(along[0], along[1], vertices_[v].place.curve);
    return true;
  }
  return false;
}

// A vertex in the middle of an edge; on the curve if the edge is locked. Without an owner if that cannot be told.
PatchVertex ImprovePatch::between(Index a, Index b) const {
  const PatchVertex &u = vertices_[a], &v = vertices_[b];
  PatchVertex middle;
  middle.free = true;
  middle.x = 0.5 * (u.x + v.x);
  Index owner = u.owner != kNone ? u.owner : v.owner;
  if (owner == kNone) return middle;
  const LockedEdge* locked = locked_edge(a, b);
  if (!locked) {
    middle.x = map_->project(middle.x, owner, middle.normal);
    middle.owner = owner;
    return middle;
  }
  if (locked->curve == kNone) return middle;
  const auto [from, to] = stretch(*locked);
  middle.place = {Kind::curve, locked->curve, kNone, curves_->wrap(locked->curve, 0.5 * (from + to))};
  middle.x = curves_->point(locked->curve, middle.place.position);
  middle.owner = owner;
  return middle;
}

bool ImprovePatch::split(Index a, Index b) {
  const bool locked = is_locked(a, b);
  std::size_t left, right;
  if (!locked && !triangles_at(a, b, left, right)) return false;
  const PatchVertex middle = between(a, b);
  if (middle.owner == kNone) return false;
  const Index m = add_vertex(middle);
  const std::vector<Index> star = stars_[a];
  for (const Index t : star) {
    if (!has(triangles_[t].v, b)) continue;
    Triangle other = triangles_[t].v, kept = triangles_[t].v;
    const Vec3 facing = triangles_[t].facing;
    std::replace(kept.begin(), kept.end(), b, m);
    std::replace(other.begin(), other.end(), a, m);
    replace(t, kept, facing);
    add_triangle(other);
    triangles_.back().facing = facing;
  }
  if (locked) {
    unlock(a, b);
    set_locked(a, m, middle.place.curve);
    set_locked(m, b, middle.place.curve);
  }
  return true;
}

bool ImprovePatch::insert(std::size_t triangle) {
  const Triangle t = triangles_[triangle].v;
  const Vec3 facing = triangles_[triangle].facing;
  PatchVertex centre;
  centre.free = true;
  centre.owner = vertices_[t[0]].owner;
  const Vec3 middle = (1.0 / 3) * (vertices_[t[0]].x + vertices_[t[1]].x + vertices_[t[2]].x);
  centre.x = map_->project(middle, centre.owner, centre.normal);
  const Index m = add_vertex(centre);
  replace(triangle, {t[0], t[1], m}, facing);
  for (const Triangle& other : {Triangle{t[1], t[2], m}, Triangle{t[2], t[0], m}}) {
    add_triangle(other);
    triangles_.back().facing = facing;
  }
  return true;
}

std::vector<std::array<Index, 2>> ImprovePatch::wanted_flips(Index v) const {
  struct Flip {
    int gain;
    std::array<Index, 2> edge;
  };
  std::vector<Flip> flips;
  for (const Index t : stars_[v])
    for (int m = 0; m < 3; ++m) {
      const Index a = triangles_[t].v[m], b = triangles_[t].v[(m + 1) % 3];
      std::size_t left, right;
      if (is_locked(a, b) || !triangles_at(a, b, left, right)) continue;
      const Index c = opposite(triangles_[left].v, a, b), d = opposite(triangles_[right].v, a, b);
      const int gain = excess_degree(a) + excess_degree(b) - excess_degree(c) - excess_degree(d) - 2;
      const std::array<Index, 2> edge = key(a, b);
      if (gain >= 0 && std::none_of(flips.begin(), flips.end(), [&](const Flip& f) { return f.edge == edge; }))
        flips.push_back({gain, edge});
    }
  std::sort(flips.begin(), flips.end(),
            [](const Flip& f, const Flip& g) { return f.gain != g.gain ? f.gain > g.gain : f.edge < g.edge; });
  std::vector<std::array<Index, 2>> edges;
  for (const Flip& f : flips) edges.push_back(f.edge);
  return edges;
}

std::vector<std::array<Index, 2>> ImprovePatch::edges_at_worst() const {
  const PatchTriangle* worst = nullptr;
  for (const PatchTriangle& t : triangles_) {
    if (!t.alive || (worst && t.cost <= worst->cost)) continue;
    std::array<Vec3, 3> x;
    for (int m = 0; m < 3; ++m) x[m] = vertices_[t.v[m]].x;
    const bool free = std::any_of(t.v.begin(), t.v.end(), [&](Index v) { return vertices_[v].free; });
    if (!free) continue;
    const std::array<bool, 3> locked = locked_edges(t);
    if (!angle_is_imposed(x, locked) || free_angle_lack(x, locked, kBadAngle) > 0) worst = &t;
  }
  std::vector<std::array<Index, 2>> edges;
  if (!worst) return edges;
  const auto shared = [&](const Triangle& t) {
    return std::count_if(t.begin(), t.end(), [&](Index v) { return has(worst->v, v); });
  };
  for (const Index v : worst->v)
    for (const Index t : stars_[v])
      if (const Triangle& w = triangles_[t].v; shared(w) > 1)
        for (int m = 0; m < 3; ++m) edges.push_back(key(w[m], w[(m + 1) % 3]));
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

Index ImprovePatch::farthest_neighbour(Index v) const {
  Index farthest = kNone;
  double most = -1;
  for (const Index t : stars_[v])
    for (const Index w : triangles_[t].v) {
      const double squared = norm2(vertices_[w].x - vertices_[v].x);
      if (w == v || squared < most || (squared == most && w >= farthest)) continue;
      most = squared;
      farthest = w;
    }
  return farthest;
}

std::size_t ImprovePatch::largest_triangle(Index v) const {
  std::size_t largest = 0;
  double most = -1;
  for (const Index t : stars_[v]) {
    const Triangle& w = triangles_[t].v;
    const double squared = norm2(cross(vertices_[w[1]].x - vertices_[w[0]].x, vertices_[w[2]].x - vertices_[w[0]].x));
    if (squared < most || (squared == most && t >= largest)) continue;
    most = squared;
    largest = t;
  }
  return largest;
}

bool ImprovePatch::relax(Index v, double hold) {
  if (stars_[v].empty()) return false;
  PatchVertex& vertex = vertices_[v];
  double before = 0, length = 0;
  for (const Index t : stars_[v]) {
    before += triangles_[t].cost;
    const Triangle& w = triangles_[t].v;
    length += norm(vertices_[w[0] == v ? w[1] : w[0]].x - vertices_[v].x);
  }
  length /= static_cast<double>(stars_[v].size());
  if (vertex.step == 0) {
    vertex.step = kFirstStep * length;
    vertex.start = vertex.x;
  }
  if (vertex.step < kLastStep * length) return false;
  hold /= length * length;
  before += hold * norm2(vertex.x - vertex.start);

  const PatchVertex old = vertex;
  PatchVertex best = old;
  double least = before;
  const auto attempt = [&] {
    const double cost = star_cost(v) + hold * norm2(vertex.x - vertex.start);
    if (cost < least) {
      least = cost;
      best = vertex;
    }
    return cost;
  };
  const double s = old.step;
  if (old.place.kind == Kind::curve) {
    const auto go = [&](double way) {
      vertex.place.position = curves_->wrap(old.place.curve, old.place.position + way);
      vertex.x = curves_->point(old.place.curve, vertex.place.position);
      return attempt();
    };
    const double ahead = go(s), behind = go(-s);
    go(s * lowest(behind, before, ahead));
  } else {
    // The trials are in the tangent plane.
    const auto go = [&](const Vec3& way) {
      vertex.x = old.x + way;
      return attempt();
    };
    const Vec3& n = old.normal;
    const Vec3 u = unit(cross(n, std::abs(n.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0})), w = cross(n, u);
    const double u_ahead = go(s * u), u_behind = go(-s * u), w_ahead = go(s * w), w_behind = go(-s * w);
    go(s * (lowest(u_behind, before, u_ahead) * u + lowest(w_behind, before, w_ahead) * w));
    if (least < before) {
      vertex = best;
      vertex.x = map_->project(best.x, vertex.owner, vertex.normal);
      least = before;
      best = old;
      attempt();
    }
  }
  vertex = best;
  if (least >= before) {
    vertex.step *= 0.5;
    return false;
  }
  for (const Index t : stars_[v]) triangles_[t].cost = cost_of(triangles_[t]);
  return true;
}

void ImprovePatch::relax_all(int sweeps) {
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    if (sweep % kFlipEvery == 0) make_delaunay();
    for (Index v = 0; v < vertices_.size(); ++v)
      if (vertices_[v].free && !vertices_[v].removed && vertices_[v].place.kind != Kind::fixed) relax(v, kHold);
  }
  make_delaunay();
}

}  // namespace bisector
