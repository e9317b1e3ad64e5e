// Improvement of tetrahedral meshes: slivers are removed and the mean shape raised, with the boundary kept.
//
// The worst tetrahedra first, each is given the change that raises the least of the dihedral angles around it most:
// swaps and contractions (tet_swap.h), smoothing (smooth.h), and, where all that has come to an end, new vertices
// (tet_insert.h). After Freitag and Ollivier-Gooch 1997 and Klingner and Shewchuk 2007. The mesh need not be
// Delaunay, before or after.
#pragma once

#include <vector>

#include "bisector/context.h"
#include "bisector/tetmesh.h"
#include "tetmesh/slide.h"

namespace bisector {

struct TetImproveOptions {
  // Degrees, in (0, 60]: tetrahedra with a dihedral angle below this, or above 180 less this, are worked on.
  double goal = 35;
  double insert_below = 30;  // likewise: where nothing else helps, such tetrahedra get new vertices
  double insertions = 0.01;  // new vertices, at most, over those of the mesh given
  int rounds = 30;           // at most
  TetSlide slide = {};       // how boundary vertices may move; as it is, they don't
};

TetShapes measure_shapes(const TetMesh& mesh, double goal);

struct TetImproveResult {
  TetMesh mesh;               // kept vertices in the order given, then new ones; marks as given
  std::vector<Index> source;  // for each vertex the one it was in the mesh given, or kNone
  TetImproveReport report;
};

// All tetrahedra of the result are exactly positive and conforming, the least sine of a dihedral angle is not lower
// than before, and the facets of the boundary, between regions, and marked ones are those given, with the same
// corners in the same places unless they may slide; marked edges stay, too. The same mesh gives the same result.
// Throws Error if a tetrahedron is flat or inverted, an index is out of range, a coordinate is not finite, the
// regions are not as many as the tetrahedra, a facet has more than two of those, or an option is out of range; throws
// Cancelled.
TetImproveResult improve_tets(const TetMesh& mesh, const TetImproveOptions& options = {}, const Context& context = {});

}  // namespace bisector
