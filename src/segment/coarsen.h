// The mesh with clusters of triangles in place of triangles, for what is decided on a coarse scale.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"
#include "segment/segment_domain.h"

namespace bisector {

struct CoarseDomain {
  SegmentDomain domain;           // its triangles are each the one in the middle of a cluster
  std::vector<Index> cluster_of;  // of each triangle of the finer domain
};

// Joins neighbouring triangles in pairs, pairs in fours and so on, the flattest and most compact first, until there are
// at most `most` clusters or creases keep too many of them apart. A cluster's moments are exact, and its four samples
// have the area, the centroid and the second moments of it, so that distances to planes are exact as well.
CoarseDomain coarsened(const SegmentDomain& domain, std::size_t most);

}  // namespace bisector
