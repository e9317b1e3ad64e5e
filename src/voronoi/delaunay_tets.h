// The Delaunay tetrahedra of points.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

// The Delaunay tetrahedra of distinct points, positive, sorted, the lowest vertex of each first; where more than four
// points lie on one empty sphere, some triangulation of them. Of equal points only one is used. Empty if all lie in a
// plane.
std::vector<Tetrahedron> delaunay_tets(const std::vector<Vec3>& points);

}  // namespace bisector
