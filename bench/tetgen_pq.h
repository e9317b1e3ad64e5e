// The yardstick for tetrahedral meshes that keep their boundary's vertices: TetGen's refinement.
#pragma once

#include "core/geometry.h"

namespace bisector::bench {

// TetGen -pq (radius-edge ratio 2) of a closed surface, with volumes of at most that of a regular tetrahedron of edge
// length `edge`.
TetMesh tetgen_pq(const TriangleMesh& surface, double edge);

}  // namespace bisector::bench
