#include "voronoi/batched_moments.h"

namespace bisector {

BatchedMoments::BatchedMoments() : compute_(widest_compute_polygons()), batches_(PolygonBatch::kMost + 1) {
  for (std::size_t n = 0; n < batches_.size(); ++n) batches_[n].numbers.corners = n;
}

void BatchedMoments::begin(const Surface& surface, const SortedSeeds& seeds) {
  surface_ = &surface;
  seeds_ = &seeds;
}

void BatchedMoments::add(std::size_t facet, Index slot, std::span<const Index> labels, Moments& moments,
                         char& unknown) {
  if (labels.size() < 3 || labels.size() > PolygonBatch::kMost) {
    unknown = 1;
    return;
  }
  Batch& batch = batches_[labels.size()];
  batch.numbers.put(batch.filled, *surface_, facet, *seeds_, slot, labels);
  batch.results[batch.filled++] = {&moments, &unknown};
  if (batch.filled == PolygonBatch::kLanes) finish(batch);
}

void BatchedMoments::finish() {
  for (Batch& batch : batches_)
    if (batch.filled) finish(batch);
}

void BatchedMoments::finish(Batch& batch) {
  compute_(batch.numbers, surface_->density.empty());
  for (std::size_t lane = 0; lane < batch.filled; ++lane) {
    *batch.results[lane].moments = batch.numbers.moments(lane);
    *batch.results[lane].unknown = !(batch.numbers.fits[lane] > 0);
  }
  batch.filled = 0;
}

}  // namespace bisector
