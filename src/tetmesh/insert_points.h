// Points put into a tetrahedral mesh one by one, with everything kept that TetEdit keeps: tetrahedra that conform to
// a given boundary and have given inner vertices come from any tetrahedra of that boundary.
#pragma once

#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"

namespace bisector {

// The mesh with the points in it. `vertices` becomes the vertex of each point, or kNone for points that are outside,
// on something kept, or at a vertex; the mesh's own vertices stay the first ones, and the points follow in the order
// given. A point's cavity are the tetrahedra with the point in their circumscribed sphere, without those that the
// boundary would hide from it (Bowyer 1981, Watson 1981): Delaunay where the boundary allows. Throws Error as
// improve_tets does, and for a point that is not finite; throws Cancelled.
TetMesh insert_points(const TetMesh& mesh, const std::vector<Vec3>& points, std::vector<Index>& vertices,
                      const Context& context = {});

}  // namespace bisector
