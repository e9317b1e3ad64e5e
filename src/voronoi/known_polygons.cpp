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
  for (std::size_t n = 0; n < batches_.size(); ++n) batches_[n].numbers.corners = n;
}

void KnownPolygons::begin(const Surface& surface, const SortedSeeds& seeds, const Neighbours& neighbours,
                          const Index* owner, Screens& screens) {
  surface_ = &surface;
  seeds_ = &seeds;
  neighbours_ = &neighbours;
  owner_ = owner;
  screens_ = &screens;
}

void KnownPolygons::add(Index index, Index slot, std::span<const Index> labels, Moments& moments, char& fails) {
  const std::size_t count = labels.size();
  if (fails) return;
  fails = count < 3 || count > PolygonBatch::kMost;
  const FacetSummary& summary = surface_->summaries[index];
  for (std::size_t k = 0, previous = count - 1; k < count; previous = k++) {
    if (!is_edge(labels[k]) || !is_edge(labels[previous])) continue;
    const Index corner = labels[k] & ~kEdgeLabel;
    if ((labels[previous] & ~kEdgeLabel) != (corner + 2) % 3 || owner_[summary.vertex[corner]] != slot) fails = 1;
  }
  if (fails) return;
  const Facet& facet = surface_->facets[index];
  Batch& batch = batches_[count];
  PolygonBatch& numbers = batch.numbers;
  const std::size_t lane = batch.filled++;
  batch.polygons[lane] = {slot, labels.data(), &moments, &fails};
  const auto put = [lane](PolygonBatch::Row* rows, const Vec3& p) {
    rows[0][lane] = p.x;
    rows[1][lane] = p.y;
    rows[2][lane] = p.z;
  };
  for (int k = 0; k < 3; ++k) {
    put(numbers.corner[k], facet.corners[k]);
    numbers.runs_on[k][lane] = facet.origin[k] == k;
  }
  put(numbers.normal, facet.normal);
  put(numbers.anchor, facet.corners[facet.anchor]);
  put(numbers.seed, seeds_->x[slot]);
  if (!surface_->density.empty()) {
    for (int k = 0; k < 3; ++k) numbers.density[k][lane] = facet.density[k];
    numbers.anchor_density[lane] = facet.density[facet.anchor];
    put(numbers.gradient, facet.gradient);
  }
  for (std::size_t k = 0; k < count; ++k) {
    const bool edge = is_edge(labels[k]);
    numbers.edge[k][lane] = edge ? static_cast<double>(labels[k] & ~kEdgeLabel) : -1;
    if (!edge) put(numbers.other[k], seeds_->x[labels[k]]);
  }
  if (batch.filled == PolygonBatch::kLanes) finish(batch);
}

void KnownPolygons::finish() {
  for (Batch& batch : batches_)
    if (batch.filled) finish(batch);
}

void KnownPolygons::finish(Batch& batch) {
  static const Compute compute = best_compute();
  const PolygonBatch& numbers = batch.numbers;
  compute(batch.numbers, surface_->density.empty());
  for (std::size_t lane = 0; lane < batch.filled; ++lane) {
    const Polygon& polygon = batch.polygons[lane];
    if (*polygon.fails) continue;
    if (!(numbers.fits[lane] > 0) || !is_certain(batch, lane)) {
      *polygon.fails = 1;
      continue;
    }
    *polygon.moments = {numbers.mass[lane],
                        {numbers.first[0][lane], numbers.first[1][lane], numbers.first[2][lane]},
                        numbers.second[lane]};
  }
  batch.filled = 0;
}

// Whether every other seed is certain to be farther from the vertices than those whose cells meet there. Of the
// polygons that meet in a vertex, the one of the lowest slot sees to it; it does so for all of its vertices at once.
bool KnownPolygons::is_certain(const Batch& batch, std::size_t lane) const {
  struct Splat {
    FourFloats x, y, z;
  };
  Splat splats[PolygonBatch::kMost];
  std::size_t corners[PolygonBatch::kMost], count = 0;
  const Polygon& polygon = batch.polygons[lane];
  const PolygonBatch& numbers = batch.numbers;
  const double scale = screens_->scale();
  double squared = 0, slack = 0;
  const auto splat = [scale](double value) {
    const float single = static_cast<float>(scale * value);
    return FourFloats{single, single, single, single};
  };
  const auto sees_to = [&](Index label) { return is_edge(label) || label > polygon.slot; };
  for (std::size_t k = 0, previous = numbers.corners - 1; k < numbers.corners; previous = k++) {
    const Index before = polygon.labels[previous], after = polygon.labels[k];
    if ((is_edge(before) && is_edge(after)) || !sees_to(before) || !sees_to(after)) continue;
    splats[count] = {splat(numbers.at[k][0][lane]), splat(numbers.at[k][1][lane]), splat(numbers.at[k][2][lane])};
    corners[count++] = k;
    squared = std::max(squared, numbers.squared[k][lane]);
    slack = std::max(slack, numbers.slack[k][lane]);
  }
  if (count == 0) return true;
  const Reach reach(squared, slack, kInfinity, scale);
  const NeighbourList list = neighbours_->list(polygon.slot);
  const std::size_t listed = static_cast<std::size_t>(list.end - list.begin);
  CellScreen& screen = screens_->of(polygon.slot, list);
  for (std::size_t k = 0; k < std::min(listed, CellScreen::kListed); k += 4) {
    const ScreenBlock& block = screens_->block(screen, polygon.slot, list, k / 4);
    if (reach.is_safe_from(block)) return true;
    const unsigned present = (1u << std::min<std::size_t>(4, listed - k)) - 1;
    unsigned near = present & may_cut(block, reach.margin, [&](const auto& test) {
                      for (std::size_t v = 0; v < count; ++v) test(splats[v].x, splats[v].y, splats[v].z);
                    });
    for (; near; near &= near - 1) {
      const Index j = list.begin[k + static_cast<unsigned>(std::countr_zero(near))];
      for (std::size_t v = 0; v < count; ++v) {
        const std::size_t corner = corners[v], previous = corner ? corner - 1 : numbers.corners - 1;
        if (j == polygon.labels[corner] || j == polygon.labels[previous]) continue;
        const Vec3 at{numbers.at[corner][0][lane], numbers.at[corner][1][lane], numbers.at[corner][2][lane]};
        const Vec3 d = seeds_->x[j] - seeds_->x[polygon.slot];
        if (!(dot(at, d) + numbers.slack[corner][lane] * taxicab(d) < BisectorLimits(0.5 * norm2(d)).before))
          return false;
      }
    }
  }
  return listed <= CellScreen::kListed && (list.radius == kInfinity || reach.is_safe_from(list.radius * list.radius));
}

}  // namespace bisector
