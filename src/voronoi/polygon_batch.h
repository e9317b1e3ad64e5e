// Polygons with the same number of corners, side by side.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "voronoi/moments.h"
#include "voronoi/neighbours.h"
#include "voronoi/surface.h"

namespace bisector {

struct PolygonBatch {
  static constexpr std::size_t kLanes = 8, kMost = 9;  // corners
  using Row = double[kLanes];

  std::size_t corners = 0;
  // Of the facet.
  alignas(64) Row corner[3][3];
  Row normal[3], anchor;  // which of the corners
  Row runs_on[3];         // of each edge: 1 if its line runs from its own corner, else 0
  Row density[3], gradient[3];
  // The seed; of each corner of the polygon, the line of the edge that starts there: the facet's edge, or -1 and the
  // other seed.
  Row seed[3];
  Row edge[kMost], other[kMost][3];
  // Results: vertices relative to the seed, their squared lengths, bounds of the errors of their coordinates, 1 where
  // all are certain to lie within the facet; moments.
  Row at[kMost][3], squared[kMost], slack[kMost], fits;
  Row mass, first[3], second;

  // Puts in the polygon of a cell on a facet, bounded by these labels in cyclic order, the least first: slots or facet
  // edges. Of no more than kMost corners.
  void put(std::size_t lane, const Surface& surface, std::size_t facet, const SortedSeeds& seeds, Index slot,
           std::span<const Index> labels);
  Moments moments(std::size_t lane) const {
    return {mass[lane], {first[0][lane], first[1][lane], first[2][lane]}, second[lane]};
  }
};

inline void PolygonBatch::put(std::size_t lane, const Surface& surface, std::size_t index, const SortedSeeds& seeds,
                              Index slot, std::span<const Index> labels) {
  const auto put_vector = [lane](Row* rows, const Vec3& p) {
    rows[0][lane] = p.x;
    rows[1][lane] = p.y;
    rows[2][lane] = p.z;
  };
  const Facet& facet = surface.facets[index];
  for (int k = 0; k < 3; ++k) {
    put_vector(corner[k], facet.corners[k]);
    runs_on[k][lane] = facet.origin[k] == k;
  }
  put_vector(normal, facet.normal);
  anchor[lane] = facet.anchor;
  put_vector(seed, seeds.x[slot]);
  if (const FacetDensity* at_corners = surface.density_of(index)) {
    for (int k = 0; k < 3; ++k) density[k][lane] = at_corners->at[k];
    put_vector(gradient, at_corners->gradient);
  }
  for (std::size_t k = 0; k < labels.size(); ++k) {
    const bool on_edge = is_edge(labels[k]);
    edge[k][lane] = on_edge ? static_cast<double>(labels[k] & ~kEdgeLabel) : -1;
    if (!on_edge) put_vector(other[k], seeds.x[labels[k]]);
  }
}

// Sets the results of a batch, of a surface with or without densities.
using ComputePolygons = void (*)(PolygonBatch&, bool uniform);
// The one for this processor.
ComputePolygons widest_compute_polygons();

// Any polygons, in batches of those with the same number of corners, each with an item of what belongs to it.
template <class Item>
class PolygonBatches {
 public:
  struct Batch {
    PolygonBatch numbers;
    Item items[PolygonBatch::kLanes];
    std::size_t filled = 0;
  };

  PolygonBatches() : batches_(PolygonBatch::kMost + 1) {
    for (std::size_t n = 0; n < batches_.size(); ++n) batches_[n].numbers.corners = n;
  }

  // Starts a set of polygons of these seeds. Both must outlive it.
  void begin(const Surface& surface, const SortedSeeds& seeds) {
    surface_ = &surface;
    seeds_ = &seeds;
    compute_ = widest_compute_polygons();
  }
  static bool takes(std::size_t corners) { return corners >= 3 && corners <= PolygonBatch::kMost; }
  // Adds a polygon, of a number of corners that it takes, as PolygonBatch::put() does. What is full goes, with results,
  // to `take(batch)`.
  template <class Take>
  void add(std::size_t facet, Index slot, std::span<const Index> labels, const Item& item, const Take& take) {
    Batch& batch = batches_[labels.size()];
    batch.numbers.put(batch.filled, *surface_, facet, *seeds_, slot, labels);
    batch.items[batch.filled++] = item;
    if (batch.filled == PolygonBatch::kLanes) compute(batch, take);
  }
  // The same for all that are left.
  template <class Take>
  void finish(const Take& take) {
    for (Batch& batch : batches_)
      if (batch.filled) compute(batch, take);
  }

 private:
  template <class Take>
  void compute(Batch& batch, const Take& take) {
    compute_(batch.numbers, surface_->density.empty());
    take(batch);
    batch.filled = 0;
  }

  const Surface* surface_ = nullptr;
  const SortedSeeds* seeds_ = nullptr;
  ComputePolygons compute_ = nullptr;
  std::vector<Batch> batches_;  // by number of corners
};

}  // namespace bisector
