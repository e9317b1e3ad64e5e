#include "voronoi/boundary_cell.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "bisector/error.h"
#include "voronoi/error_bounds.h"
#include "voronoi/polyhedra.h"

namespace bisector {
namespace {

constexpr std::size_t kFirstNeighbours = 32;  // of most cells these bound all that is inside
constexpr int kUnset = std::numeric_limits<int>::min();
// A volume below this part of the sum of its terms' absolute values may be nothing but rounding.
constexpr double kVisible = 64 * kUnit;

Moments& operator-=(Moments& a, const Moments& b) {
  a.mass -= b.mass;
  a.first -= b.first;
  a.second -= b.second;
  return a;
}

// Terms of the tetrahedron from the seed, the origin, to the triangle (a, b, c).
Moments cone_terms(const Vec3& a, const Vec3& b, const Vec3& c) { return tet_terms(a, b, c, dot(a, cross(b, c))); }

}  // namespace

void BoundaryCell::reset(const SortedSeeds& seeds, const Neighbours& neighbours) {
  seeds_ = &seeds;
  polygons_.reset(seeds);
  cell_.reset(seeds, neighbours);
}

std::uint64_t BoundaryCell::edge_of(Index a, Index b) const {
  const std::uint64_t i = seeds_->id[a], j = seeds_->id[b];
  return i < j ? i << 32 | j : j << 32 | i;
}

void BoundaryCell::add(const Moments& cone, const Moments& edges) {
  Moments sum = cone;
  sum += scaled_terms<true>(edges);
  magnitude_ += std::abs(cone.mass) + kSixth * std::abs(edges.mass);
  sum_.add(sum);
}

// Adds the terms of the polygon's edges on bisectors, and lists these and the corners on Voronoi edges. In the face of
// a bisector an edge runs the other way than in the polygon, and the face is fanned out from its middle.
void BoundaryCell::trace_polygon(const CellPolygon& polygon, Moments& sum) {
  const std::size_t n = polygon.labels.size();
  for (std::size_t k = 0, before = n - 1; k < n; before = k++) {
    const Index label = polygon.labels[k], last = polygon.labels[before];
    if (is_edge(label)) continue;
    bisectors_.push_back(label);
    const Vec3 &p = polygons_.vertex(k), &q = polygons_.vertex(k + 1 == n ? 0 : k + 1);
    sum += cone_terms(0.5 * (seeds_->x[label] - seed_), q, p);
    if (is_edge(last)) continue;
    crossed_.mark(label);
    crossed_.mark(last);
    const auto order = static_cast<Index>(crossings_.size());
    crossings_.push_back({edge_of(last, label), order, seeds_->id[last] < seeds_->id[label] ? 1 : -1, p});
  }
}

void BoundaryCell::trace(std::span<const CellPolygon> polygons) {
  bisectors_.clear();
  crossings_.clear();
  crossed_.begin(seeds_->x.size());
  magnitude_ = 0;
  sum_.finish();  // of a cell that was left open
  for (const CellPolygon& polygon : polygons) {
    const Facet& facet = surface_.facets[polygon.facet];
    const double height = dot(facet.normal, facet.corners[facet.anchor] - seed_);
    const Moments& flat = polygon.moments;
    const Moments cone{kThird * height * flat.mass, 0.25 * height * flat.first, 0.2 * height * flat.second};
    Moments edges;
    if (!polygon.labels.empty()) {
      polygons_.begin(surface_, polygon.facet);
      polygons_.take(slot_, polygon.labels.data(), polygon.labels.size());
      trace_polygon(polygon, edges);
    }
    add(cone, edges);
  }
  std::sort(crossings_.begin(), crossings_.end(),
            [](const Crossing& a, const Crossing& b) { return std::tie(a.edge, a.order) < std::tie(b.edge, b.order); });
}

// Whether the list has all seeds that are known to bound the cell.
bool BoundaryCell::lists_bisectors() {
  listed_.begin(seeds_->x.size());
  cell_.each_label([&](Index label) {
    if (!is_facet(label)) listed_.mark(label);
  });
  return std::none_of(bisectors_.begin(), bisectors_.end(), [&](Index label) { return listed_.mark(label); });
}

// Finds the crossings on the edges at each vertex.
void BoundaryCell::count_crossings() {
  const std::size_t n = cell_.vertex_count();
  edges_.assign(3 * n, {crossings_.size(), 0});
  if (crossings_.empty()) return;
  for (std::size_t v = 0; v < n; ++v)
    for (std::size_t e = 0; e < 3; ++e) {
      const Index first = cell_.label_at(v, (e + 1) % 3), second = cell_.label_at(v, (e + 2) % 3);
      if (is_facet(first) || is_facet(second) || !crossed_.has(first) || !crossed_.has(second)) continue;
      const std::uint64_t edge = edge_of(first, second);
      auto crossing = std::lower_bound(crossings_.begin(), crossings_.end(), edge,
                                       [](const Crossing& c, std::uint64_t of) { return c.edge < of; });
      // The vertex is the edge's end in the direction of first x second.
      const int sense = seeds_->id[first] < seeds_->id[second] ? 1 : -1;
      Edge& found = edges_[3 * v + e];
      found.first = static_cast<std::size_t>(crossing - crossings_.begin());
      for (; crossing != crossings_.end() && crossing->edge == edge; ++crossing) found.net += sense * crossing->sign;
    }
}

// Sets the levels of all vertices from the first one's. False if they contradict each other.
bool BoundaryCell::propagate() {
  level_.assign(cell_.vertex_count(), kUnset);
  level_[0] = 0;
  queue_.assign(1, 0);
  for (std::size_t head = 0; head < queue_.size(); ++head) {
    const Index v = queue_[head];
    for (std::size_t e = 0; e < 3; ++e) {
      const Index other = cell_.adjacent(v, e);
      const int level = level_[v] + edges_[3 * v + e].net;
      if (level_[other] == kUnset) {
        level_[other] = level;
        queue_.push_back(other);
      } else if (level_[other] != level) {
        return false;
      }
    }
  }
  return true;
}

// Which vertices are inside, as far as the list can tell.
BoundaryCell::Found BoundaryCell::find_sides(Side vertices) {
  const std::size_t n = cell_.vertex_count();
  const auto reaches_out = [&](std::size_t v) {  // to the enclosure's facets
    return is_facet(cell_.label_at(v, 0)) || is_facet(cell_.label_at(v, 1)) || is_facet(cell_.label_at(v, 2));
  };
  if (n == 0 || !lists_bisectors()) return Found::uncertain;
  count_crossings();
  if (!propagate()) return Found::uncertain;
  const auto [least, most] = std::minmax_element(level_.begin(), level_.end());
  if (*most > *least + 1) return Found::uncertain;
  if (*most > *least) {
    inside_.resize(n);
    for (std::size_t v = 0; v < n; ++v) inside_[v] = level_[v] == *most;
    for (std::size_t v = 0; v < n; ++v)
      if (inside_[v] && (!cell_.is_certain(v) || reaches_out(v))) return Found::uncertain;
    return Found::settled;
  }
  // All vertices are on one side.
  bool some_certain = false, all_certain = true, outside = vertices == Side::outside;
  for (std::size_t v = 0; v < n; ++v) {
    const bool certain = cell_.is_certain(v);
    some_certain |= certain;
    all_certain &= certain;
    outside |= certain && reaches_out(v);
  }
  if (!some_certain) return Found::uncertain;
  if (!outside && vertices == Side::unknown) return Found::open;
  if (!outside && !all_certain) return Found::uncertain;
  inside_.assign(n, !outside);
  return Found::settled;
}

// What the Voronoi edge between the bisectors towards `first` and `second`, of lower and of higher index, adds to their
// faces: of the parts inside, those of its crossings and of its ends that are.
Moments BoundaryCell::edge_moments(Index from, Index to, Index first, Index second, std::size_t crossing) const {
  const Vec3 middle_first = 0.5 * (seeds_->x[first] - seed_), middle_second = 0.5 * (seeds_->x[second] - seed_);
  const Vec3* base = nullptr;
  Moments sum;
  const auto meet = [&](const Vec3& p, int sign) {
    if (!base) {
      base = &p;
      return;
    }
    Moments part = cone_terms(middle_first, *base, p);
    part += cone_terms(middle_second, p, *base);
    if (sign > 0) sum += part;
    else sum -= part;
  };
  if (inside_[from]) meet(cell_.vertex(from), -1);
  const std::uint64_t edge = edge_of(first, second);
  for (; crossing < crossings_.size() && crossings_[crossing].edge == edge; ++crossing)
    meet(crossings_[crossing].at, crossings_[crossing].sign);
  if (inside_[to]) meet(cell_.vertex(to), 1);
  return sum;
}

void BoundaryCell::add_edges() {
  terms_.clear();
  for (Index v = 0; v < cell_.vertex_count(); ++v)
    for (std::size_t e = 0; e < 3; ++e) {
      const Index first = cell_.label_at(v, (e + 1) % 3), second = cell_.label_at(v, (e + 2) % 3);
      // Each edge is seen from both ends, in one sense from either.
      if (is_facet(first) || is_facet(second) || seeds_->id[first] > seeds_->id[second]) continue;
      const Index from = cell_.adjacent(v, e);
      const std::uint64_t edge = edge_of(first, second);
      const std::size_t crossing = edges_[3 * v + e].first;
      const bool crossed = crossing < crossings_.size() && crossings_[crossing].edge == edge;
      if (!crossed && !inside_[v] && !inside_[from]) continue;
      terms_.push_back({edge, edge_moments(from, v, first, second, crossing)});
    }
  std::sort(terms_.begin(), terms_.end(), [](const Term& a, const Term& b) { return a.edge < b.edge; });
  for (const Term& term : terms_) add({}, term.moments);
}

bool BoundaryCell::integrate(Index slot, std::span<const CellPolygon> polygons, Side vertices) {
  slot_ = slot;
  seed_ = seeds_->x[slot];
  uncertain_ = wider_ = false;
  trace(polygons);
  cell_.begin(slot);
  cell_.shorten(kFirstNeighbours);
  for (;;) {
    cell_.cut_by_listed(enclosure_);
    uncertain_ |= cell_.uncertain();
    const Found found = find_sides(vertices);
    if (found == Found::settled) break;
    if (found == Found::open) return false;
    // Of a surface that bounds a solid, polygons and Voronoi vertices cannot contradict each other.
    if (cell_.lists_all())
      throw Error("the boundary of the solid crosses itself, or tetrahedra overlap; repair the mesh");
    wider_ |= !cell_.is_shortened();
    cell_.widen();
  }
  add_edges();
  moments_ = sum_.finish();
  if (moments_.mass < kVisible * magnitude_) moments_ = {};
  list_reached();
  return true;
}

void BoundaryCell::list_reached() {
  reached_.clear();
  met_.begin(seeds_->x.size());
  for (std::size_t v = 0; v < cell_.vertex_count(); ++v)
    for (std::size_t e = 0; inside_[v] && e < 3; ++e)
      if (const Index label = cell_.label_at(v, e); met_.mark(label)) reached_.push_back(label);
}

void BoundaryCell::append_polyhedron(ClippedPolyhedra& polyhedra) {
  const auto before = [&](Index a, Index b) { return seeds_->id[a] < seeds_->id[b]; };
  labels_ = reached_;
  labels_.insert(labels_.end(), bisectors_.begin(), bisectors_.end());
  std::sort(labels_.begin(), labels_.end(), before);
  labels_.erase(std::unique(labels_.begin(), labels_.end()), labels_.end());
  place_.resize(seeds_->x.size());
  for (Index k = 0; k < labels_.size(); ++k) place_[labels_[k]] = k;
  std::vector<PolyhedronVertex> vertices;
  for (std::size_t v = 0; v < cell_.vertex_count(); ++v)
    if (inside_[v])
      vertices.push_back({{place_[cell_.label_at(v, 0)], place_[cell_.label_at(v, 1)], place_[cell_.label_at(v, 2)]},
                          cell_.vertex(v)});
  bisector::append_polyhedron(labels_, vertices, *seeds_, kNone, slot_, polyhedra);
}

}  // namespace bisector
