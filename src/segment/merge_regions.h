// A start that is the same for every random seed: small regions merged pairwise, the pair that costs least first.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/context.h"
#include "bisector/segment.h"
#include "core/geometry.h"
#include "segment/segment_domain.h"

namespace bisector {

// Planar regions by merging triangles (Garland, Willmott and Heckbert 2001; here the cost of a pair is by how much the
// squared distance to planes grows), down to `count` of them or the number of components, as long as the sum of squared
// distances is at most `most`.
std::vector<Index> merge_into_planes(const SegmentDomain& domain, std::size_t count, double most,
                                     const Context& context);

struct RegionMerging {
  std::size_t count = 1;        // regions wanted
  double squared_distance = 0;  // with count 0: merge as long as the sum of squared distances is at most so much
  SegmentSurfaces surfaces = SegmentSurfaces::all;
};

// Goes on from regions with planes, quadrics and tori as proxies. Pairs whose quadric is invalid are not merged by it.
std::vector<Index> merge_regions(const SegmentDomain& domain, std::vector<Index> labels, const RegionMerging& options,
                                 const Context& context);

}  // namespace bisector
