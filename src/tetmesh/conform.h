// Tetrahedra that conform to a boundary mesh (thesis 5.5.3).
#pragma once

#include <vector>

#include "tetmesh/tetgen.h"

namespace bisector {

struct ConformingTets {
  TetMesh mesh;             // the boundary's vertices, then the points, then Steiner points; marks as TetgenResult
  bool delaunay = false;    // the tetrahedra are Delaunay: no facet was missing
  std::size_t missing = 0;  // triangles of the boundary that are not facets of the Delaunay triangulation of all
  std::size_t steiner_points = 0;  // added by TetGen, all inside
  std::vector<Index> refused;      // points that are no vertices, ascending
};

// Tetrahedra inside a closed surface, as check_surface gives it, whose boundary facets are exactly its triangles, with
// the points as vertices. They are those of the Delaunay triangulation of all vertices if it has every triangle of the
// boundary as a facet; that is the rule where the boundary is the dual of a surface diagram with the ball property and
// no inner cell meets the surface. Otherwise points in the diametral spheres of missing triangles are put in last
// (insert_points.h): after the Delaunay triangulation of the others, or, if boundary vertices are in each other's way,
// all of them into TetGen's tetrahedra of the boundary. Points that are not inside or fit nowhere are left out.
//
// Throws Error as tetgen_tets does where TetGen is needed; for two vertices at the same point or one that is not
// finite; and if TetGen's tetrahedra are flat. Throws Cancelled.
ConformingTets conforming_tets(const TriangleMesh& boundary, const std::vector<Vec3>& points,
                               const TetgenOptions& options = {}, const Context& context = {});

}  // namespace bisector
