#include "voronoi/known_polygons.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "voronoi/error_bounds.h"

namespace bisector {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

void KnownPolygons::begin(const Surface& surface, const SortedSeeds& seeds, const Neighbours& neighbours,
                          const Index* owner, Screens& screens) {
  surface_ = &surface;
  seeds_ = &seeds;
  neighbours_ = &neighbours;
  owner_ = owner;
  screens_ = &screens;
  batches_.begin(surface, seeds);
}

void KnownPolygons::add(Index index, Index slot, std::span<const Index> labels, Moments& moments, char& fails) {
  const std::size_t count = labels.size();
  if (fails) return;
  fails = !Batches::takes(count);
  const FacetSummary& summary = surface_->summaries[index];
  for (std::size_t k = 0, previous = count - 1; k < count; previous = k++) {
    if (!is_edge(labels[k]) || !is_edge(labels[previous])) continue;
    const Index corner = labels[k] & ~kEdgeLabel;
    if ((labels[previous] & ~kEdgeLabel) != (corner + 2) % 3 || owner_[summary.vertex[corner]] != slot) fails = 1;
  }
  if (fails) return;
  batches_.add(index, slot, labels, {slot, labels.data(), &moments, &fails},
               [this](const Batch& batch) { take(batch); });
}

void KnownPolygons::finish() {
  batches_.finish([this](const Batch& batch) { take(batch); });
}

void KnownPolygons::take(const Batch& batch) const {
  const PolygonBatch& numbers = batch.numbers;
  const std::size_t n = numbers.corners;
  std::array<Vertex, PolygonBatch::kLanes * PolygonBatch::kMost> vertices;
  std::size_t count = 0;
  for (std::size_t lane = 0; lane < batch.filled; ++lane) {
    const Polygon& polygon = batch.items[lane];
    *polygon.moments = numbers.moments(lane);
    *polygon.fails |= !(numbers.fits[lane] > 0);
    // Of the polygons that meet in a vertex, the one of the lowest slot sees to it; edges compare as greater.
    for (std::size_t k = 0, previous = n - 1; k < n; previous = k++) {
      const Index before = polygon.labels[previous], after = polygon.labels[k];
      vertices[count] = {before, after, static_cast<unsigned char>(lane), static_cast<unsigned char>(k)};
      count += (before > polygon.slot) & (after > polygon.slot) & !is_edge(before & after);
    }
  }
  for (std::size_t v = 0; v < count; ++v) {
    char& fails = *batch.items[vertices[v].lane].fails;
    if (!fails && !is_certain(batch, vertices[v])) fails = 1;
  }
}

// Whether every other seed is certain to be farther from the vertex than those whose cells meet there.
bool KnownPolygons::is_certain(const Batch& batch, const Vertex& vertex) const {
  const PolygonBatch& numbers = batch.numbers;
  const std::size_t lane = vertex.lane;
  const Index slot = batch.items[lane].slot;
  const PolygonBatch::Row* row = numbers.at[vertex.corner];
  const Vec3 at{row[0][lane], row[1][lane], row[2][lane]};
  const double slack = numbers.slack[vertex.corner][lane], scale = screens_->scale();
  const Reach reach(numbers.squared[vertex.corner][lane], slack, kInfinity, scale);
  const auto splat = [scale](double value) {
    const float single = static_cast<float>(scale * value);
    return FourFloats{single, single, single, single};
  };
  const FourFloats x = splat(at.x), y = splat(at.y), z = splat(at.z);
  const NeighbourList list = neighbours_->list(slot);
  const std::size_t listed = static_cast<std::size_t>(list.end - list.begin);
  CellScreen& screen = screens_->of(slot, list);
  const auto near_of = [&](std::size_t block) {
    return may_cut(screens_->block(screen, slot, list, block), reach.margin, [&](const auto& test) { test(x, y, z); });
  };
  // Two blocks at a time, of which most vertices need no more.
  for (std::size_t k = 0; k < std::min(listed, CellScreen::kListed); k += 8) {
    if (k && reach.is_safe_from(screens_->block(screen, slot, list, k / 4))) return true;
    unsigned near = near_of(k / 4);
    near |= near_of(k / 4 + 1) << 4;
    for (; near; near &= near - 1) {
      const Index j = list.begin[k + static_cast<unsigned>(std::countr_zero(near))];
      if (j == vertex.before || j == vertex.after) continue;
      const Vec3 d = seeds_->x[j] - seeds_->x[slot];
      if (!(dot(at, d) + slack * taxicab(d) < BisectorLimits(0.5 * norm2(d)).before)) return false;
    }
  }
  return listed <= CellScreen::kListed && (list.radius == kInfinity || reach.is_safe_from(list.radius * list.radius));
}

}  // namespace bisector
