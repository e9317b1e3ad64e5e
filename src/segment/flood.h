// Partitions of the triangles among proxies.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"
#include "segment/proxy.h"
#include "segment/segment_domain.h"

namespace bisector {

struct FloodSeed {
  Index triangle, region;
};

// Distortion-minimising flooding (thesis 2.3.1; Cohen-Steiner, Alliez and Desbrun 2004): regions grow from one seed
// triangle each, always by the triangle of least distance to the proxy that reaches it. Fills the triangles labelled
// kNone that can be reached; others are left alone. `distances` gets each filled triangle's distance_to its proxy. Adds
// the distances it takes to `evaluations`.
void flood(const SegmentDomain& domain, const std::vector<Proxy>& proxies, const std::vector<FloodSeed>& seeds,
           std::vector<Index>& labels, std::vector<double>& distances, std::size_t& evaluations);

// Moves triangles at borders to the region across where they are nearer to its proxy and no region comes apart, until
// there are none; of the given triangles and what is around those that move. Returns how many it moved.
std::size_t relax_borders(const SegmentDomain& domain, const std::vector<Proxy>& proxies, std::vector<Index> triangles,
                          std::vector<Index>& labels, std::vector<double>& distances, std::size_t& evaluations);

}  // namespace bisector
