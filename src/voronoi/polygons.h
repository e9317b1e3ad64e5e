// Polygons of a diagram as they leave a clipper.
#pragma once

#include "voronoi/clip.h"
#include "voronoi/restricted.h"

namespace bisector {

// Appends the clipper's polygon on the triangle, starting at the edge of the smallest label; slots become the caller's indices.
void append_polygon(const Clipper& clipper, const SortedSeeds& seeds, Index triangle, Index slot, RestrictedPolygons& out);

}  // namespace bisector
