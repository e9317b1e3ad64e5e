// Tetrahedra that conform to a boundary mesh (thesis 5.5.3).
#pragma once

#include <vector>

#include "bisector/tetmesh/tetgen.h"

namespace bisector {

struct ConformingTets {
  TetMesh mesh;             // the boundary's vertices, then the points, then Steiner points; marks as TetgenResult
  bool delaunay = false;    // the tetrahedra are Delaunay: no facet was missing
  std::size_t missing = 0;  // triangles of the boundary that are not facets of the Delaunay triangulation
  std::size_t steiner_points = 0;  // added by TetGen where facets were missing, all inside
  std::size_t zero_volume = 0;
};

// Tetrahedra inside a closed surface, as check_surface gives it, whose boundary facets are exactly its triangles, with
// the points, all inside, as vertices. They are those of the Delaunay triangulation of all vertices if it has every
// triangle of the boundary as a facet; that is the rule where the boundary is the dual of a surface diagram with the
// ball property and no inner cell meets the surface. Otherwise TetGen's. Throws Error as tetgen_tets does, and if two
// vertices lie at the same point or a point is not inside.
ConformingTets conforming_tets(const TriangleMesh& boundary, const std::vector<Vec3>& points,
                               const TetgenOptions& options = {}, const Context& context = {});

}  // namespace bisector
