// Shorter borders between regions by graph cuts in strips of triangles along them: alpha-expansion (Boykov, Veksler and
// Zabih 2001, section 5) with the triangles of alpha free to shrink as well (Schmidt and Alahari 2011).
#pragma once

#include <functional>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "segment/dual_graph.h"

namespace bisector {

struct SmoothBordersOptions {
  std::vector<double> weights;  // of each region, squared distance per length: a piece of border costs its length times
                                // the mean of its two regions' weights
  int rings = 0;                // width of the strip: triangles up to so many edges' steps from the border; 0: as many
                                // as the cuts reach
  int sweeps = 10;              // over all regions
};

struct SmoothBordersResult {
  std::size_t cuts = 0,
              refused = 0;  // regions whose borders changed; cuts that would have changed the topology
};

// Lowers the sum of the triangles' distances and the borders' costs. Each region in turn, in ascending order, takes
// from all regions that it meets and gives to them at once, by the cut of least energy, until none changes.
// `distance(t, r)` is triangle t's squared distance to region r's proxy, times its area. Of a cut that would take a
// region apart, empty it, or change its Euler characteristic, its borders' number of loops or which regions it meets,
// the triangles that do so stay where they are, or parts of it are made, or nothing. Regions have to be connected.
// Throws Error for weights that are negative or not finite, or are not one for each region, and Cancelled.
SmoothBordersResult smooth_borders(const DualGraph& graph, const std::vector<Triangle>& triangles,
                                   const std::function<double(Index, Index)>& distance,
                                   const SmoothBordersOptions& options, std::vector<Index>& labels,
                                   const Context& context = {});

}  // namespace bisector
