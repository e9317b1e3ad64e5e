// How much the length of borders between regions counts beside distances to their proxies, by what the distances leave
// unexplained.
#pragma once

#include <vector>

#include "core/geometry.h"
#include "segment/proxy.h"
#include "segment/segment_domain.h"

namespace bisector {

// For each region 2 s^2 l: s is the root mean square distance to its proxy and l^2 the area over which distances are
// alike, that of a vertex where they are noise and more where the proxy is not the surface's shape. The weight makes
// squared distances plus weighted lengths the negative logarithm of a likelihood, Gaussian distances with one sample for
// each such area against borders of one unit for each such length (Potts; Geman and Geman 1984).
std::vector<double> border_weights(const SegmentDomain& domain, const std::vector<Index>& labels,
                                   const std::vector<Proxy>& proxies);

}  // namespace bisector
