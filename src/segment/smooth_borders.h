// Shorter borders between regions by graph cuts in a strip of triangles along them (thesis 2.3.3, "Boundary
// smoothing").
#pragma once

#include <functional>
#include <vector>

#include "core/geometry.h"
#include "segment/dual_graph.h"

namespace bisector {

struct SmoothBordersOptions {
  double lambda = 1;  // weight of the borders' length
  int rings = 1;      // width of the strip: triangles up to so many edges' steps from the border
  int sweeps = 6;     // over all pairs of regions that meet
};

struct SmoothBordersResult {
  std::size_t cuts = 0,
              refused = 0;  // pairs of regions whose border changed; cuts that would have changed the topology
};

// Moves triangles between regions that share a border, one pair at a time in ascending order, where the thesis' energy
// E1 + lambda E2 of the pair is least. `distance(t, r)` is triangle t's squared distance to region r's proxy. Of a cut
// that would take a region apart, empty it, or change its Euler characteristic, its borders' number of loops or which
// regions it meets, the triangles that do so stay where they are, or parts of it are made, or nothing. Regions have to
// be connected. Throws Error for a weight that is negative or not finite.
SmoothBordersResult smooth_borders(const DualGraph& graph, const std::vector<Triangle>& triangles,
                                   const std::function<double(Index, Index)>& distance,
                                   const SmoothBordersOptions& options, std::vector<Index>& labels);

}  // namespace bisector
