// The boundary of a tetrahedral mesh.
#pragma once

#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// The facets with one tetrahedron, counter-clockwise seen from outside positive ones, by ascending tetrahedron and
// facet.
std::vector<Triangle> boundary_facets(const std::vector<Tetrahedron>& tets);

// These, and the facets between tetrahedra of different regions, each once, as the first of its two has it.
std::vector<Triangle> wall_facets(const TetMesh& mesh);

// The boundary as a surface of its own: the vertices that it uses, ascending, the labels of marked triangles (0
// elsewhere, none if all are 0), those feature edges that are edges of it, and the attributes of vertices. `vertices`,
// if not null, gets the mesh's vertex of each.
TriangleMesh boundary_surface(const TetMesh& mesh, std::vector<Index>* vertices = nullptr);

}  // namespace bisector
