// A mesh whose vertices and triangles lie in memory as they lie in space.
#pragma once

#include <vector>

#include "bisector/mesh.h"

namespace bisector {

struct OrderedMesh {
  TriangleMesh mesh;
  // Of each of the given mesh's vertices, the one it has become; kNone: no triangle uses it.
  std::vector<Index> vertex_of;
};

// The same mesh with its vertices along a Hilbert curve, and its triangles by their lowest vertex, with which each
// begins; triangles keep their orientation and labels. Vertices that no triangle uses are left out. Where no two
// vertices are at the same point and no two triangles have the same corners, the result does not depend on the order in
// which the mesh lists them. Corners must be indices of vertices, and coordinates finite.
OrderedMesh in_spatial_order(const TriangleMesh& mesh);

}  // namespace bisector
