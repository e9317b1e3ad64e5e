// A surface as the kernels read it.
#pragma once

#include <cstddef>
#include <vector>

#include "host/device/buffer.h"
#include "host/device/commands.h"
#include "voronoi/surface.h"

namespace bisector::host {

// The power of two by which lengths are multiplied on the device: a surface's diagonal is then near 2^24, so that
// second moments of all of it and of cells 2^-50 of its size are within the range of single precision.
double device_scale(const Surface& surface);

// Facets in one precision, in as many chunks as the device's bindings need; chunks are the same in both precisions.
struct FacetChunk {
  std::size_t first, count;  // facets
  Buffer words, meta, wholes;
};
std::vector<FacetChunk> upload_facets(Device& device, Commands& commands, const Surface& surface, double scale,
                                      bool is_double);

// A range of facets that is worked on at once.
struct FacetBatch {
  std::size_t first, count;
  std::size_t first_sample, sample_count;
};

// Points on facets much larger than a cell.
struct FacetSamples {
  std::vector<Vec3> points;
  std::vector<Index> facets;  // of each point, ascending
  std::vector<FacetBatch> batches;
  double expected_pairs = 0;  // for seeds that follow the area
};

// Batches that are expected to have about `batch_pairs` pairs with `seeds` cells, none of them crossing a border of
// `chunks`.
FacetSamples plan_batches(const Surface& surface, const std::vector<FacetChunk>& chunks, std::size_t seeds,
                          double batch_pairs);

}  // namespace bisector::host
