// Moments of polygons that are known by their labels, of many at once.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "voronoi/moments.h"
#include "voronoi/neighbours.h"
#include "voronoi/polygon_batch.h"
#include "voronoi/surface.h"

namespace bisector {

class BatchedMoments {
 public:
  BatchedMoments();

  // Starts a set of polygons of these seeds. Both must outlive it.
  void begin(const Surface& surface, const SortedSeeds& seeds);
  // Adds the polygon of a cell on a facet, bounded by these labels in cyclic order, the least first: slots or facet
  // edges. Until finish() has returned, `moments` are set, those about the seed that Clipper::integrate() gives after
  // Clipper::take(); or `unknown` is set to 1 where that may take exact arithmetic.
  void add(std::size_t facet, Index slot, std::span<const Index> labels, Moments& moments, char& unknown);
  // Deals with all that were added.
  void finish();

 private:
  struct Result {
    Moments* moments;
    char* unknown;
  };
  struct Batch {
    PolygonBatch numbers;
    Result results[PolygonBatch::kLanes];
    std::size_t filled = 0;
  };

  void finish(Batch& batch);

  const Surface* surface_ = nullptr;
  const SortedSeeds* seeds_ = nullptr;
  ComputePolygons compute_;
  std::vector<Batch> batches_;  // by number of corners
};

}  // namespace bisector
