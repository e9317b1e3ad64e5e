#include "voronoi/clip.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "voronoi/error_bounds.h"

namespace bisector {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

void Clipper::Polygon::reserve(std::size_t count) {
  if (corners.size() >= count) return;
  corners.resize(2 * count);
  edges.resize(2 * count);
}

Clipper::Clipper() : lines_(16) {
  for (unsigned k = 0; k < 3; ++k) lines_[k].slot = kEdgeLabel | k;
}

void Clipper::reset(const SortedSeeds& seeds) {
  seeds_ = &seeds;
  screens_.reset(seeds);
}

void Clipper::begin(const Surface& surface, std::size_t index) {
  const Facet& facet = surface.facets[index];
  facet_ = &facet;
  density_ = surface.density_of(index);
  for (unsigned k = 0; k < 3; ++k) {
    Line& line = lines_[k];
    const unsigned from = facet.origin[k], to = from == k ? (k + 1) % 3 : k;
    line.along = facet.corners[from] - facet.corners[to];
    line.m = cross(line.along, facet.normal);
    line.squared = norm2(line.along);
    line.key = facet.rank[k];
  }
}

void Clipper::start(Index slot) {
  slot_ = slot;
  uncertain_ = wider_ = false;
  largest_ = facet_squared_ = 0;
  for (int k = 0; k < 3; ++k) {
    local_[k] = facet_->corners[k] - seeds_->x[slot];
    largest_ = std::max(largest_, max_coordinate(local_[k]));
    facet_squared_ = std::max(facet_squared_, norm2(local_[k]) * (1 + 1e-12));
  }
  line_count_ = 3;
  polygon_.reserve(3);
  polygon_.size = 0;
  for (unsigned k = 0; k < 3; ++k) polygon_.push(k) = {local_[k], kCornerSlack * largest_};
}

void Clipper::take(Index slot) { start(slot); }

bool Clipper::clip(const Neighbours& neighbours, Index slot) {
  start(slot);
  place_lines();
  bounded_ = false;
  NeighbourList list = neighbours.list(slot);
  for (;;) {
    const std::size_t count = static_cast<std::size_t>(list.end - list.begin);
    const std::size_t screened = std::min(count, CellScreen::kListed);
    CellScreen& screen = screens_.of(slot, list);
    std::size_t k = 0;
    for (; k < screened; k += 4) {
      if (!bounded_) bound_polygon();
      const ScreenBlock& block = screens_.block(screen, slot, list, k / 4);
      if (reach_.is_safe_from(block)) return true;
      const unsigned present = (1u << std::min<std::size_t>(4, count - k)) - 1;
      for (unsigned lines = lines_that_may_cut(block) & present; lines; lines &= lines - 1)
        if (!visit(list.begin[k + static_cast<unsigned>(std::countr_zero(lines))])) return false;
    }
    for (; k < count; ++k) {
      if (!bounded_) bound_polygon();
      if (reach_.is_safe_from(norm2(seeds_->x[list.begin[k]] - seeds_->x[slot]))) return true;
      if (!visit(list.begin[k])) return false;
    }
    if (!bounded_) bound_polygon();
    if (list.radius == kInfinity || reach_.is_safe_from(list.radius * list.radius)) return true;
    wider_ = true;
    list = neighbours.wider(slot, list);
  }
}

bool Clipper::clip(std::span<const Index> others, Index slot) {
  start(slot);
  place_lines();
  bounded_ = false;
  const auto is_left = [&](Index other) {
    if (other == slot) return true;
    if (!bounded_) bound_polygon();
    const Vec3 d = seeds_->x[other] - seeds_->x[slot];
    const double squared = norm2(d);
    if (!reach_.is_safe_from(squared)) cut(other, d, squared);
    return polygon_.size > 0;
  };
  // Slots that are near in their order are near in space, and cut away most of what there is to cut away.
  const auto middle = std::lower_bound(others.begin(), others.end(), slot);
  for (auto before = middle, after = middle; before != others.begin() || after != others.end();) {
    if (after != others.end() && !is_left(*after++)) return false;
    if (before != others.begin() && !is_left(*--before)) return false;
  }
  return true;
}

void Clipper::place_lines() {
  height_ = dot(facet_->normal, local_[facet_->anchor]);
  foot_ = height_ * facet_->normal;
  for (unsigned k = 0; k < 3; ++k)
    lines_[k].offset = dot(lines_[k].m, local_[facet_->origin[k]]) - height_ * dot(facet_->normal, lines_[k].m);
}

unsigned Clipper::add_line(Index other, const Vec3& d, double squared) {
  if (lines_.size() == line_count_) lines_.resize(2 * line_count_);
  Line& line = lines_[line_count_];
  line.m = d;
  line.along = cross(facet_->normal, d);
  line.offset = 0.5 * squared - height_ * dot(facet_->normal, d);
  line.squared = squared;
  line.key = std::uint64_t{3} + seeds_->id[other];
  line.slot = other;
  return static_cast<unsigned>(line_count_++);
}

void Clipper::set_labels(const Index* labels, std::size_t count) {
  polygon_.reserve(count);
  polygon_.size = 0;
  for (std::size_t k = 0; k < count; ++k) {
    if (is_edge(labels[k])) {
      polygon_.push(labels[k] & ~kEdgeLabel);
    } else {
      const Vec3 d = seeds_->x[labels[k]] - seeds_->x[slot_];
      polygon_.push(add_line(labels[k], d, norm2(d)));
    }
  }
}

void Clipper::take(Index slot, const Index* labels, std::size_t count) {
  start(slot);
  place_lines();
  set_labels(labels, count);
  for (std::size_t k = 0; k < count; ++k) {
    const Line &before = lines_[polygon_.edges[previous(k)]], &after = lines_[polygon_.edges[k]];
    if (is_edge(before.slot) && is_edge(after.slot))
      polygon_.corners[k] = {local_[after.slot & ~kEdgeLabel], kCornerSlack * largest_};
    else add_corner(before, after, polygon_.corners[k]);
  }
}

unsigned Clipper::lines_that_may_cut(const ScreenBlock& block) const {
  return may_cut(block, reach_.margin, [&](const auto& test) {
    for (std::size_t k = 0; k < polygon_.size; ++k) test(splats_[k].x, splats_[k].y, splats_[k].z);
  });
}

bool Clipper::visit(Index other) {
  const Vec3 d = seeds_->x[other] - seeds_->x[slot_];
  if (wider_ && bounded_by(other)) return true;
  cut(other, d, norm2(d));
  return polygon_.size > 0;
}

bool Clipper::bounded_by(Index other) const {
  for (std::size_t k = 0; k < polygon_.size; ++k)
    if (label(k) == other) return true;
  return false;
}

void Clipper::cut(Index other, const Vec3& d, double squared) {
  const std::size_t n = polygon_.size;
  const double one_norm = taxicab(d);
  const BisectorLimits limits(0.5 * squared);
  if (sides_.size() < n) sides_.resize(2 * n);
  std::size_t outside = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double along = dot(polygon_.corners[k].at, d), error = polygon_.corners[k].slack * one_norm;
    int side = along + error < limits.before ? 1 : along - error > limits.behind ? -1 : 0;
    if (side == 0) {
      uncertain_ = true;
      side = exact_side(frame(), exact(lines_[polygon_.edges[previous(k)]]), exact(lines_[polygon_.edges[k]]),
                        ExactLine::bisector(seeds_->x[other], seeds_->id[other]));
    }
    sides_[k] = static_cast<signed char>(side);
    outside += side < 0;
  }
  if (outside == 0) return;
  if (outside == n) {
    polygon_.size = 0;
    return;
  }
  const unsigned edge = add_line(other, d, squared);
  // The polygon is convex: its corners on the positive side are consecutive, from `in` up to `last`.
  std::size_t in = 0;
  while (!(sides_[in] > 0 && sides_[previous(in)] < 0)) ++in;
  kept_.reserve(n - outside + 2);
  kept_.size = 0;
  std::size_t k = in, last = in;
  do {
    kept_.push(polygon_.edges[k]) = polygon_.corners[k];
    last = k;
    k = k + 1 == n ? 0 : k + 1;
  } while (sides_[k] > 0);
  const unsigned leaving = polygon_.edges[last], entering = polygon_.edges[previous(in)];
  add_corner(lines_[leaving], lines_[edge], kept_.push(edge));
  add_corner(lines_[edge], lines_[entering], kept_.push(entering));
  std::swap(polygon_, kept_);
  bounded_ = false;
}

void Clipper::bound_polygon() {
  bounded_ = true;
  double squared = 0, slack = 0;
  for (std::size_t k = 0; k < polygon_.size; ++k) {
    slack = std::max(slack, polygon_.corners[k].slack);
    squared = std::max(squared, norm2(polygon_.corners[k].at));
  }
  reach_ = Reach(squared, slack, facet_squared_, screens_.scale());
  if (splats_.size() < polygon_.size) splats_.resize(2 * polygon_.size);
  for (std::size_t k = 0; k < polygon_.size; ++k) {
    const Vec3 p = screens_.scale() * polygon_.corners[k].at;
    const float x = static_cast<float>(p.x), y = static_cast<float>(p.y), z = static_cast<float>(p.z);
    splats_[k] = {FourFloats{x, x, x, x}, FourFloats{y, y, y, y}, FourFloats{z, z, z, z}};
  }
}

// In the facet's plane with origin at the seed's foot, the lines' normals are the parts of m along the plane, and the
// lines cross at (c2 t1 - c1 t2) / (t1 . m2). All data are within the facet's distance P of the seed, and with rounded
// data and operations each term of the numerator is off by less than 250 u P |m1| |m2| and the determinant by 150 u
// |m1| |m2| (the normal's own error, at most 60 u, included), which bounds the error of the quotient as coded.
bool Clipper::meet(const Line& before, const Line& after, Corner& corner) const {
  const double determinant = dot(before.along, after.m);
  const double squares = before.squared * after.squared;
  const double square = determinant * determinant;
  if (!(square > kSteep * squares)) return false;
  const double inverse = 1 / determinant;
  Vec3 w = inverse * (after.offset * before.along - before.offset * after.along);
  if (!(square > kShallow * squares)) {
    // The determinant's error takes w off both lines; what is left then is an error along them, which hardly changes an
    // area. Only the lines' normals in the plane will do for it: m times the error of w across the plane may be far
    // larger.
    const Vec3 n = facet_->normal;
    const double left_before = before.offset - dot(cross(before.along, n), w);
    const double left_after = after.offset - dot(cross(after.along, n), w);
    w += inverse * (left_after * before.along - left_before * after.along);
  }
  corner.at = foot_ + w;
  corner.slack = 2000 * kUnit * largest_ * std::sqrt(squares / square);
  return true;
}

void Clipper::add_corner(const Line& before, const Line& after, Corner& corner) const {
  if (meet(before, after, corner)) return;
  corner.at = exact_vertex(frame(), exact(before), exact(after));
  corner.slack = kExactSlack * largest_;
}

double Clipper::density(std::size_t k) const {
  const double* r = density_->at;
  const Index after = label(k);
  if (is_edge(after) && is_edge(label(previous(k)))) return r[after & ~kEdgeLabel];
  const double value = r[facet_->anchor] + dot(density_->gradient, vertex(k) - local_[facet_->anchor]);
  return std::min(std::max(value, std::min({r[0], r[1], r[2]})), std::max({r[0], r[1], r[2]}));
}

// The start of the edge with the smallest label: where the fan of triangles starts.
std::size_t Clipper::first_corner() const {
  std::size_t first = 0;
  for (std::size_t k = 1; k < polygon_.size; ++k)
    if (lines_[polygon_.edges[k]].key < lines_[polygon_.edges[first]].key) first = k;
  return first;
}

template <bool kUniform>
Moments Clipper::integrate_with() {
  const std::size_t n = polygon_.size;
  if constexpr (!kUniform) {
    densities_.resize(n);
    for (std::size_t k = 0; k < n; ++k) densities_[k] = density(k);
  }
  const std::size_t apex = first_corner();
  const auto next = [n](std::size_t k) { return k + 1 == n ? 0 : k + 1; };
  const Vec3 a = vertex(apex);
  const double squared_a = norm2(a);
  Moments sum;
  double squared_b = norm2(vertex(next(apex)));
  for (std::size_t b = next(apex), c = next(b); c != apex; b = c, c = next(c)) {
    const double area = 0.5 * dot(facet_->normal, cross(vertex(b) - a, vertex(c) - a));
    if constexpr (kUniform) {
      const double squared_c = norm2(vertex(c));
      sum += triangle_moments(a + vertex(b) + vertex(c), squared_a + squared_b + squared_c, area);
      squared_b = squared_c;
    } else sum += triangle_moments(a, vertex(b), vertex(c), densities_[apex], densities_[b], densities_[c], area);
  }
  return sum;
}

Moments Clipper::integrate() { return density_ ? integrate_with<false>() : integrate_with<true>(); }

ExactFrame Clipper::frame() const {
  return {{facet_->corners[0], facet_->corners[1], facet_->corners[2]}, seeds_->x[slot_], seeds_->id[slot_]};
}

ExactLine Clipper::exact(const Line& line) const {
  if (is_edge(line.slot)) return ExactLine::edge(static_cast<int>(((line.slot & ~kEdgeLabel) + 2) % 3));
  return ExactLine::bisector(seeds_->x[line.slot], seeds_->id[line.slot]);
}

}  // namespace bisector
