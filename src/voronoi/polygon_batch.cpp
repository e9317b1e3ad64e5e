#include "voronoi/polygon_batch.h"

#include "core/lanes.h"
#include "voronoi/error_bounds.h"

namespace bisector {
namespace {

#define BISECTOR_LANES_FILE "voronoi/polygon_lanes.inl"
#include "core/each_lanes.inl"

}  // namespace

ComputePolygons widest_compute_polygons() { return of_widest_lanes(avx512::compute, avx2::compute, portable::compute); }

}  // namespace bisector
