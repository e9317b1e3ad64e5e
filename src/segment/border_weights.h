// How much the length of borders between regions counts beside distances to their proxies, by what the distances leave
// unexplained.
#pragma once

#include <vector>

#include "core/geometry.h"
#include "segment/proxy.h"
#include "segment/segment_domain.h"

namespace bisector {

// For each region 8 s^2 l: s is the root mean square distance to its proxy and l^2 the area over which distances are
// alike, that of a vertex where they are noise and more where the proxy does not have the surface's shape. So squared
// distances plus weighted lengths are, up to a factor, the negative logarithm of a likelihood: Gaussian distances, one
// sample for each such area, and borders that cost four units for each such length (Geman and Geman 1984). In
// SmoothBordersOptions' units: distances in the unit-sized model, lengths in the mesh's.
std::vector<double> border_weights(const SegmentDomain& domain, const std::vector<Index>& labels,
                                   const std::vector<Proxy>& proxies);

}  // namespace bisector
