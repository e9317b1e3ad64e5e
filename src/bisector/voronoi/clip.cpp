#include "bisector/voronoi/clip.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bisector {
namespace {

constexpr double kUnit = 0x1p-53;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Within these, products of three scales neither overflow nor lose precision to underflow.
constexpr double kSmallestScale = 0x1p-160, kLargestScale = 0x1p+160;
// Lines that meet at a smaller angle (sine, squared) have their vertex computed exactly.
constexpr double kSteep = 1e-8;

}  // namespace

Clipper::Clipper() : lines_(3) {
  for (unsigned k = 0; k < 3; ++k) {
    Line& line = lines_[k];
    for (unsigned m = 0; m < 3; ++m) line.h[m] = m == (k + 2) % 3;
    line.scale = 1;
    line.squared = 0;
    line.slot = kEdgeLabel | k;
    line.id = kNone;
  }
}

void Clipper::start(const SortedSeeds& seeds, const Facet& facet, Index slot) {
  seeds_ = &seeds;
  facet_ = &facet;
  slot_ = slot;
  uncertain_ = wider_ = false;
  lines_.resize(3);
  edges_.assign({0, 1, 2});
  largest_ = 0;
  for (int k = 0; k < 3; ++k) {
    local_[k] = facet.corners[k] - seeds.x[slot];
    largest_ = std::max({largest_, std::abs(local_[k].x), std::abs(local_[k].y), std::abs(local_[k].z)});
  }
}

void Clipper::take(const SortedSeeds& seeds, const Facet& facet, Index slot) { start(seeds, facet, slot); }

bool Clipper::clip(const SortedSeeds& seeds, const Neighbours& neighbours, const Facet& facet, Index slot) {
  start(seeds, facet, slot);
  vertices_.resize(3);
  facet_squared_ = 0;
  for (unsigned k = 0; k < 3; ++k) {
    Vertex& v = vertices_[k];
    for (unsigned m = 0; m < 3; ++m) v.lambda[m] = m == k;
    v.bound = 12 * kUnit;
    v.at = local_[k];
    v.slack = 8 * kUnit * largest_;
    v.squared = norm2(v.at) * (1 + 1e-12);
    facet_squared_ = std::max(facet_squared_, v.squared);
  }
  reach_ = facet_squared_;
  const Vec3 x = seeds.x[slot];
  NeighbourList list = neighbours.list(slot);
  for (;;) {
    for (const Index* j = list.begin; j != list.end; ++j) {
      const Vec3 towards = seeds.x[*j] - x;
      const double squared = norm2(towards);
      // Security radius: all of the polygon is nearer to this seed than to any other from here on.
      if (4 * reach_ < squared * (1 - 1e-9)) return true;
      if (wider_ && std::any_of(edges_.begin(), edges_.end(), [&](unsigned e) { return lines_[e].slot == *j; })) continue;
      cut(*j, towards, squared);
      if (edges_.empty()) return false;
    }
    if (4 * reach_ < list.radius * list.radius * (1 - 1e-9) || list.radius == kInfinity) return true;
    wider_ = true;
    list = neighbours.wider(slot, list);
  }
}

void Clipper::cut(Index other, const Vec3& d, double squared) {
  const std::size_t n = edges_.size();
  const double taxicab = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  const double half = 0.5 * squared * (1 - 1e-12);
  bool apart = true;
  for (const Vertex& v : vertices_) apart &= dot(v.at, d) + v.slack * taxicab < half;
  if (apart) return;

  Line line;
  const double extent = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) + 2 * largest_;
  line.scale = taxicab * extent;
  if (!(line.scale > kSmallestScale && line.scale < kLargestScale)) line.scale = kInfinity;
  for (int m = 0; m < 3; ++m) {
    const Vec3& p = local_[m];
    line.h[m] = d.x * (d.x - 2 * p.x) + d.y * (d.y - 2 * p.y) + d.z * (d.z - 2 * p.z);
  }
  line.towards = d;
  line.squared = squared;
  line.slot = other;
  line.id = seeds_->id[other];

  sides_.resize(n);
  int outside = 0;
  for (std::size_t k = 0; k < n; ++k) {
    sides_[k] = static_cast<signed char>(side(k, line));
    outside += sides_[k] < 0;
  }
  if (outside == 0) return;
  if (outside == static_cast<int>(n)) {
    edges_.clear();
    return;
  }
  // The polygon is convex: its vertices on the positive side are consecutive, from `in` up to `out`.
  std::size_t in = 0;
  while (!(sides_[in] > 0 && sides_[in ? in - 1 : n - 1] < 0)) ++in;
  const unsigned index = static_cast<unsigned>(lines_.size());
  lines_.push_back(line);
  kept_edges_.clear();
  kept_vertices_.clear();
  std::size_t k = in, last = in;
  do {
    kept_edges_.push_back(edges_[k]);
    kept_vertices_.push_back(vertices_[k]);
    last = k;
    k = k + 1 == n ? 0 : k + 1;
  } while (sides_[k] > 0);
  kept_vertices_.push_back(meet(lines_[edges_[last]], line));
  kept_edges_.push_back(index);
  const unsigned entering = edges_[in ? in - 1 : n - 1];
  kept_vertices_.push_back(meet(line, lines_[entering]));
  kept_edges_.push_back(entering);
  edges_.swap(kept_edges_);
  vertices_.swap(kept_vertices_);
  reach_ = 0;
  for (const Vertex& v : vertices_) reach_ = std::max(reach_, v.squared);
}

int Clipper::side(std::size_t k, const Line& line) {
  const Vertex& v = vertices_[k];
  const double value = line.h[0] * v.lambda[0] + line.h[1] * v.lambda[1] + line.h[2] * v.lambda[2];
  const double bound = v.bound * line.scale;
  if (value > bound) return 1;
  if (value < -bound) return -1;
  uncertain_ = true;
  const Line& after = lines_[edges_[k]];
  const Line& before = lines_[edges_[k ? k - 1 : edges_.size() - 1]];
  return exact_side(frame(), exact(before), exact(after), exact(line));
}

// The bounds follow from |h| <= scale and the error 7 u scale of h: each component of the product a x b is off by at most
// 33 u S_a S_b, and so the value of a further line c by 99 u S_a S_b S_c + 10 u S_c sum |lambda|, to first order.
Clipper::Vertex Clipper::meet(const Line& a, const Line& b) const {
  Vertex v;
  v.lambda[0] = a.h[1] * b.h[2] - a.h[2] * b.h[1];
  v.lambda[1] = a.h[2] * b.h[0] - a.h[0] * b.h[2];
  v.lambda[2] = a.h[0] * b.h[1] - a.h[1] * b.h[0];
  const double scales = a.scale * b.scale;
  const double sum = std::abs(v.lambda[0]) + std::abs(v.lambda[1]) + std::abs(v.lambda[2]);
  v.bound = kUnit * (100 * scales + 12 * sum);
  const double total = v.lambda[0] + v.lambda[1] + v.lambda[2];
  // Error of the position, relative to the largest coordinate. Every point of the facet is within facet_squared_ anyway.
  const double error = kUnit * (200 * scales / total + 12);
  v.squared = facet_squared_;
  v.slack = kInfinity;
  if (total > 0 && error < 1e-4) {
    v.at = (1 / total) * (v.lambda[0] * local_[0] + v.lambda[1] * local_[1] + v.lambda[2] * local_[2]);
    v.slack = (error + 16 * kUnit) * largest_;
    const double off = 2 * v.slack;
    v.squared = std::min(v.squared, norm2(v.at) * (1 + 1e-6) + 2e6 * (off * off));
  }
  return v;
}

ExactFrame Clipper::frame() const {
  return {{facet_->corners[0], facet_->corners[1], facet_->corners[2]}, seeds_->x[slot_], seeds_->id[slot_]};
}

ExactLine Clipper::exact(const Line& line) const {
  if (is_edge(line.slot)) return ExactLine::edge(static_cast<int>(((line.slot & ~kEdgeLabel) + 2) % 3));
  return ExactLine::bisector(seeds_->x[line.slot], seeds_->id[line.slot]);
}

// The facet's plane and the two lines' planes, all within the cell's scale of the seed, meet at the vertex: edges as the planes
// through them along the normal, the lower label first.
Vec3 Clipper::position(const Line& before, const Line& after) const {
  if (is_edge(before.slot) && is_edge(after.slot)) return local_[after.slot & ~kEdgeLabel];
  const bool swap = is_edge(after.slot) || (!is_edge(before.slot) && after.id < before.id);
  const Line& low = swap ? after : before;
  const Line& high = swap ? before : after;
  const Vec3& n = facet_->normal;
  Vec3 m = low.towards;
  double c = 0.5 * low.squared;
  if (is_edge(low.slot)) {
    const unsigned k = low.slot & ~kEdgeLabel;
    const unsigned a = facet_->origin[k], b = a == k ? (k + 1) % 3 : k;
    m = cross(n, facet_->corners[b] - facet_->corners[a]);
    c = dot(m, local_[a]);
  }
  const Vec3 across = cross(m, high.towards);
  const double determinant = dot(n, across);
  if (!(determinant * determinant > kSteep * (norm2(m) * high.squared)))
    return exact_vertex(frame(), exact(before), exact(after));
  const double offset = dot(n, local_[facet_->anchor]);
  const Vec3 p = offset * across + c * cross(high.towards, n) + (0.5 * high.squared) * cross(n, m);
  const double inverse = 1 / determinant;
  return inverse * p;
}

double Clipper::density(const Line& before, const Line& after, const Vec3& point) const {
  const double* r = facet_->density;
  if (is_edge(before.slot) && is_edge(after.slot)) return r[after.slot & ~kEdgeLabel];
  const double value = r[facet_->anchor] + dot(facet_->gradient, point - local_[facet_->anchor]);
  return std::min(std::max(value, std::min({r[0], r[1], r[2]})), std::max({r[0], r[1], r[2]}));
}

// The entry of the edge with the smallest label: facet edges by their vertices' indices, then seeds.
std::size_t Clipper::first_entry() const {
  const auto key = [&](std::size_t k) {
    const Line& line = lines_[edges_[k]];
    return is_edge(line.slot) ? static_cast<std::uint64_t>(facet_->rank[line.slot & ~kEdgeLabel])
                              : std::uint64_t{3} + line.id;
  };
  std::size_t first = 0;
  for (std::size_t k = 1; k < edges_.size(); ++k)
    if (key(k) < key(first)) first = k;
  return first;
}

template <bool kUniform>
Moments Clipper::integrate() {
  const std::size_t n = edges_.size();
  points_.resize(n);
  if constexpr (!kUniform) densities_.resize(n);
  const Line* before = &lines_[edges_[n - 1]];
  for (std::size_t k = 0; k < n; ++k) {
    const Line* after = &lines_[edges_[k]];
    points_[k] = position(*before, *after);
    if constexpr (!kUniform) densities_[k] = density(*before, *after, points_[k]);
    before = after;
  }
  const std::size_t apex = first_entry();
  const auto next = [n](std::size_t k) { return k + 1 == n ? 0 : k + 1; };
  Moments sum;
  for (std::size_t b = next(apex), c = next(b); c != apex; b = c, c = next(c)) {
    const double area = 0.5 * dot(facet_->normal, cross(points_[b] - points_[apex], points_[c] - points_[apex]));
    if constexpr (kUniform)
      sum += triangle_moments(points_[apex], points_[b], points_[c], area);
    else
      sum += triangle_moments(points_[apex], points_[b], points_[c], densities_[apex], densities_[b], densities_[c], area);
  }
  return sum;
}

template Moments Clipper::integrate<true>();
template Moments Clipper::integrate<false>();

}  // namespace bisector
