// Removing the vertices of a labelled mesh that are not wanted, without a change of its topology or its regions'.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

struct LabelledTriangles {
  std::vector<Triangle> triangles;  // oriented alike
  std::vector<Index> labels;        // of each triangle
};

// Collapses edges (Hoppe et al. 1993) from vertices that are not `kept`, the shortest first: along the border where the
// vertex lies between two regions or on the border of the mesh, else to any neighbour. An edge is collapsed only if the
// common neighbours of its ends are the corners opposite to it (the link condition: Dey et al. 1999), and if no region
// loses its last triangle. Collapses that turn a triangle against the normal of its region, `normals`, come last.
// Vertices that this leaves stay. Those off manifold edges and vertices must be kept.
void collapse_vertices(const std::vector<Vec3>& vertices, const std::vector<char>& kept,
                       const std::vector<Vec3>& normals, LabelledTriangles& mesh);

}  // namespace bisector
