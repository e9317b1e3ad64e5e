// Triangles between loops in a plane.
#pragma once

#include <array>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// The constrained Delaunay triangulation (CGAL) of what lies to the left of the loops of one region. `points` are those
// of all vertices that the loops name. Empty unless the loops bound a region of the plane, with an outer loop
// counter-clockwise and the holes within it clockwise: they may touch in common vertices, but must not meet otherwise.
std::vector<Triangle> triangulate_loops(const std::vector<std::vector<Index>>& loops,
                                        const std::vector<std::array<double, 2>>& points);

}  // namespace bisector
