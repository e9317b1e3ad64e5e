#include "voronoi/known_polygons.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "voronoi/error_bounds.h"
#include "voronoi/polygon_batch.h"

namespace bisector {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define BISECTOR_WIDE_LANES 1
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq,avx512vl")
namespace avx512 {
constexpr int kWidth = 8;
#include "voronoi/polygon_lanes.inl"
}  // namespace avx512
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx2")
namespace avx2 {
constexpr int kWidth = 4;
#include "voronoi/polygon_lanes.inl"
}  // namespace avx2
#pragma GCC pop_options
#endif
namespace portable {
constexpr int kWidth = 2;
#include "voronoi/polygon_lanes.inl"
}  // namespace portable

using Compute = void (*)(PolygonBatch&, bool);

Compute best_compute() {
#if defined(BISECTOR_WIDE_LANES)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    return avx512::compute;
  if (__builtin_cpu_supports("avx2")) return avx2::compute;
#endif
  return portable::compute;
}

}  // namespace

KnownPolygons::KnownPolygons() : batches_(PolygonBatch::kMost + 1) {
  for (std::size_t n = 0; n <= PolygonBatch::kMost; ++n) {
    batches_[n].corners = n;
  }
}

void KnownPolygons::begin(const Surface& surface, const SortedSeeds& seeds, const Neighbours& neighbours,
                          const Index* owner, Screens& screens) {
  surface_ = &surface;
  seeds_ = &seeds;
  neighbours_ = &neighbours;
  owner_ = owner;
  screens_ = &screens;
  polygons_.clear();
  labels_.clear();
}

void KnownPolygons::add(Index index, Index slot, std::span<const Index> labels) {
  const std::size_t count = labels.size();
  const std::size_t place = polygons_.size();
  polygons_.push_back({index, slot, static_cast<Index>(labels_.size()), static_cast<Index>(count), false, {}});
  labels_.insert(labels_.end(), labels.begin(), labels.end());
  if (count < 3 || count > PolygonBatch::kMost) return;
  const FacetSummary& summary = surface_->summaries[index];
  for (std::size_t k = 0, previous = count - 1; k < count; previous = k++) {
    if (!is_edge(labels[k]) || !is_edge(labels[previous])) continue;
    const Index corner = labels[k] & ~kEdgeLabel;
    if ((labels[previous] & ~kEdgeLabel) != (corner + 2) % 3 || owner_[summary.vertex[corner]] != slot) return;
  }
  const Facet& facet = surface_->facets[index];
  PolygonBatch& batch = batches_[count];
  const std::size_t lane = batch.filled++;
  batch.polygon[lane] = place;
  const auto put = [lane](PolygonBatch::Row* rows, const Vec3& p) {
    rows[0][lane] = p.x;
    rows[1][lane] = p.y;
    rows[2][lane] = p.z;
  };
  for (int k = 0; k < 3; ++k) {
    put(batch.corner[k], facet.corners[k]);
    batch.runs_on[k][lane] = facet.origin[k] == k;
  }
  put(batch.normal, facet.normal);
  put(batch.anchor, facet.corners[facet.anchor]);
  put(batch.seed, seeds_->x[slot]);
  if (!surface_->density.empty()) {
    for (int k = 0; k < 3; ++k) batch.density[k][lane] = facet.density[k];
    batch.anchor_density[lane] = facet.density[facet.anchor];
    put(batch.gradient, facet.gradient);
  }
  for (std::size_t k = 0; k < count; ++k) {
    const bool edge = is_edge(labels[k]);
    batch.edge[k][lane] = edge ? static_cast<double>(labels[k] & ~kEdgeLabel) : -1;
    if (!edge) put(batch.other[k], seeds_->x[labels[k]]);
  }
  if (batch.filled == PolygonBatch::kLanes) finish(batch);
}

void KnownPolygons::run() {
  for (PolygonBatch& batch : batches_)
    if (batch.filled) finish(batch);
}

void KnownPolygons::finish(PolygonBatch& batch) {
  static const Compute compute = best_compute();
  compute(batch, surface_->density.empty());
  for (std::size_t lane = 0; lane < batch.filled; ++lane) {
    if (!(batch.fits[lane] > 0) || !is_certain(batch, lane)) continue;
    Polygon& polygon = polygons_[batch.polygon[lane]];
    polygon.passes = true;
    polygon.moments = {batch.mass[lane],
                       {batch.first[0][lane], batch.first[1][lane], batch.first[2][lane]},
                       batch.second[lane]};
  }
  batch.filled = 0;
}

// Of the polygons that meet in a vertex, the one of the lowest slot sees to it.
bool KnownPolygons::is_certain(const PolygonBatch& batch, std::size_t lane) const {
  const Polygon& polygon = polygons_[batch.polygon[lane]];
  const Index* labels = labels_.data() + polygon.first_label;
  const std::size_t n = batch.corners;
  const auto sees_to = [&](Index label) { return is_edge(label) || label > polygon.slot; };
  for (std::size_t k = 0, previous = n - 1; k < n; previous = k++) {
    const Index before = labels[previous], after = labels[k];
    if ((is_edge(before) && is_edge(after)) || !sees_to(before) || !sees_to(after)) continue;
    const Vec3 at{batch.at[k][0][lane], batch.at[k][1][lane], batch.at[k][2][lane]};
    if (!is_empty_ball(polygon.slot, at, batch.slack[k][lane], before, after)) return false;
  }
  return true;
}

// Whether every seed but `slot`, `one` and `other` is certain to be farther from the point, given relative to the seed,
// than the seed is.
bool KnownPolygons::is_empty_ball(Index slot, const Vec3& point, double slack, Index one, Index other) const {
  const double scale = screens_->scale();
  const Reach reach(norm2(point), slack, kInfinity, scale);
  const Vec3 p = scale * point;
  const float x = static_cast<float>(p.x), y = static_cast<float>(p.y), z = static_cast<float>(p.z);
  const NeighbourList list = neighbours_->list(slot);
  const std::size_t listed = static_cast<std::size_t>(list.end - list.begin);
  CellScreen& screen = screens_->of(slot, list);
  for (std::size_t k = 0; k < std::min(listed, CellScreen::kListed); k += 4) {
    const ScreenBlock& block = screens_->block(screen, slot, list, k / 4);
    if (reach.is_safe_from(block)) return true;
    const unsigned present = (1u << std::min<std::size_t>(4, listed - k)) - 1;
    unsigned near = present & may_cut(block, reach.margin, [&](const auto& test) { test(x, y, z); });
    for (; near; near &= near - 1) {
      const Index j = list.begin[k + static_cast<unsigned>(std::countr_zero(near))];
      if (j == one || j == other) continue;
      const Vec3 d = seeds_->x[j] - seeds_->x[slot];
      if (!(dot(point, d) + slack * taxicab(d) < BisectorLimits(0.5 * norm2(d)).before)) return false;
    }
  }
  return listed <= CellScreen::kListed && (list.radius == kInfinity || reach.is_safe_from(list.radius * list.radius));
}

}  // namespace bisector
