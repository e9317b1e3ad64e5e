// How much the length of borders between regions counts beside distances to their proxies, by what the distances leave
// unexplained.
#pragma once

#include <vector>

#include "core/geometry.h"
#include "segment/proxy.h"
#include "segment/segment_domain.h"

namespace bisector {

// What a region's proxy leaves unexplained.
struct RegionNoise {
  double area = 0, mean_square = 0;  // of the region; of its distances
  double alike_area = 0;  // over which distances are alike: that of a vertex where they are noise, more where the proxy
                          // does not have the surface's shape
};
std::vector<RegionNoise> region_noise(const SegmentDomain& domain, const std::vector<Index>& labels,
                                      const std::vector<Proxy>& proxies);

// For each region 8 s^2 l, s^2 being its mean square distance and l^2 the area over which distances are alike. So
// squared distances plus weighted lengths are, up to a factor, the negative logarithm of a likelihood: Gaussian
// distances, one sample for each such area, and borders that cost four units for each such length (Geman and Geman
// 1984). In SmoothBordersOptions' units: distances in the unit-sized model, lengths in the mesh's.
std::vector<double> border_weights(const SegmentDomain& domain, const std::vector<RegionNoise>& noise);

}  // namespace bisector
