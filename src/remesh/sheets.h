// Cells that hold several sheets of the surface, divided into one cell for each (the multinerve of the cells: Colin de
// Verdiere, Ginot and Goaoc 2012).
//
// Where sheets cross or nearly touch, every seed owns both, however many seeds there are, and the topological ball
// property cannot hold. With connected components in place of cells it can, and the dual has a vertex for each.
#pragma once

#include <vector>

#include "core/geometry.h"
#include "voronoi/ball_property.h"

namespace bisector {

// Divides the cells of which two components come nearer to each other than `gap` times the cell's radius, infinity
// meaning all. Components beyond the one nearest to the seed become cells of their own, in order of seeds, with indices
// from seeds.size() on; `seeds` is extended by a point of each, the nearest to its centroid. `report` is that of
// `polygons`. Returns whether a cell was divided.
bool divide_cells(const Surface& surface, const BallReport& report, double gap, RestrictedPolygons& polygons,
                  std::vector<Vec3>& seeds);

}  // namespace bisector
