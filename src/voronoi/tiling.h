// The certificate of a reported diagram: that its polygons tile every triangle.
#pragma once

#include <cstddef>

#include "voronoi/diagram.h"
#include "voronoi/surface.h"

namespace bisector {

// On each triangle each inner edge must occur once on either side with equal ends, and the triangle's edges must be
// covered end to end. Returns the number of triangles where that fails.
std::size_t count_untiled(const Surface& surface, const RestrictedPolygons& polygons);

}  // namespace bisector
