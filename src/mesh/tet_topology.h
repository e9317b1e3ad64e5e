// Combinatorial facts of a tetrahedral mesh and its boundary.
#pragma once

#include <vector>

#include "core/geometry.h"
#include "mesh/topology.h"

namespace bisector {

struct TetTopology {
  // Every facet has one or two tetrahedra, two lie on opposite sides of it, and no two used vertices lie at the same
  // point. With all tetrahedra positive and a boundary that is closed and free of self-intersections the mesh then
  // fills its solid once.
  bool conforming = false;
  std::size_t components = 0;          // connected through facets
  std::size_t overused_facets = 0;     // of more than two tetrahedra
  std::size_t misoriented_facets = 0;  // of two tetrahedra that lie on the same side, if both are positive
  std::size_t repeated_vertices = 0;   // used ones at the point of one with a lower index
  std::size_t unused_vertices = 0;     // of no tetrahedron
  MeshTopology boundary;               // of the facets with one tetrahedron
};

// All false and 0 if there are no tetrahedra. Every index must be in range.
TetTopology analyse_tet_topology(const TetMesh& mesh);

// The facets with one tetrahedron, counter-clockwise seen from outside positive ones, by ascending tetrahedron and
// facet.
std::vector<Triangle> boundary_facets(const std::vector<Tetrahedron>& tets);

// The boundary as a surface of its own: the vertices that it uses, ascending, the labels of marked triangles (0
// elsewhere, none if all are 0), and those feature edges that are edges of it. `vertices`, if not null, gets the mesh's
// vertex of each.
TriangleMesh boundary_surface(const TetMesh& mesh, std::vector<Index>* vertices = nullptr);

}  // namespace bisector
