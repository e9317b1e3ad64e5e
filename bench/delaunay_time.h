// The yardstick: CGAL's three-dimensional Delaunay triangulation.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector::bench {

// Seconds to build the triangulation of the seeds as CGAL's manual advises for speed: from a range, which CGAL sorts
// spatially, with the indices as info of the vertices, floating-point filtered predicates, one thread. Converting the
// points and destroying the triangulation are not counted.
double delaunay_seconds(const std::vector<Vec3>& seeds);

}  // namespace bisector::bench
