// Restricted cells without their stray parts.
//
// Near a fold of the surface, a thin wall or a thin limb a seed also owns a piece of the sheet across, apart from its
// own part of the surface. Such pieces are given to the cells around them: what is left is close to the localized
// restricted Voronoi diagram (Yan, Bao, Zhang and Wonka 2014, "Low-resolution remeshing using the localized restricted
// Voronoi diagram"), in which a cell is what its seed owns of the surface around itself. Its dual follows the surface
// with far fewer seeds.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"
#include "voronoi/restricted.h"
#include "voronoi/surface.h"

namespace bisector {

// Gives each component of a cell that is not the one nearest to the seed to the cell with which it shares the longest
// border, if its area is no larger than that cell's own. Returns how many changed hands; what could not stays where it
// is. On a triangle the parts of a cell become one polygon, perhaps not convex, whose corners between edges of the same
// label are left out: such polygons are for reading labels.
std::size_t localise_cells(const Surface& surface, const std::vector<Vec3>& seeds, RestrictedPolygons& polygons);

}  // namespace bisector
