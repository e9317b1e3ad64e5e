// Edges of a result flipped where its components cross.
#pragma once

#include "bisector/mesh.h"

namespace bisector {

// Components that have the same vertices along the curves in which they meet (remesh/intersection_curves.h) may still
// have triangles in common, all corners of which are on such curves, or triangles that cross where surfaces meet at a
// small angle. An edge of either triangle is flipped if fewer pairs cross then, unless angles below 25 degrees would
// get smaller. Feature edges stay.
void flip_where_components_cross(TriangleMesh& mesh);

}  // namespace bisector
