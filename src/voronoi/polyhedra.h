// What clipping reports of one pair.
#pragma once

#include "voronoi/clip_tet.h"
#include "voronoi/clipped.h"

namespace bisector {

// Appends the clipper's polyhedron; slots become the caller's indices. Throws Error if it has too many facets to
// number.
void append_polyhedron(TetClipper& clipper, const SortedSeeds& seeds, Index tet, Index slot,
                       ClippedPolyhedra& polyhedra);

}  // namespace bisector
