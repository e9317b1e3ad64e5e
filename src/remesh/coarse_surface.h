// Surfaces of fewer triangles, which stand in for one whose triangles are far smaller than the cells of its seeds.
#pragma once

#include <memory>

#include "bisector/features.h"
#include "voronoi/surface.h"

namespace bisector {

struct CoarseSurface {
  std::unique_ptr<Surface> surface;
  FeatureGraph features;  // of its mesh; curves that shrink to a point are left out
};

// A surface with vertices about half an edge apart, edges being as long as `edge_length` where the density is 1 (see
// CurveMeasure::scale), in the mesh's unit. Its vertices are some of `fine`'s, and each of `fine`'s others has gone to
// the nearest of them along edges, if its normal is not far from that one's; what is left of the triangles then has the
// boundary that `fine` has, if any. Features are chains of edges in it, and no closed component or closed curve is
// lost. No surface if that would not leave far fewer triangles, or if it changes the area by more than a few percent.
CoarseSurface coarse_surface(const Surface& fine, const FeatureGraph& features, double edge_length);

}  // namespace bisector
