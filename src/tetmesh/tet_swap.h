// Changes of a tetrahedral mesh's connectivity, each found as the best of its kind around a poor tetrahedron
// (Shewchuk 2002, "Two discrete optimization algorithms for the topological improvement of tetrahedral meshes";
// Klingner and Shewchuk 2007).
#pragma once

#include <vector>

#include "tetmesh/tet_edit.h"

namespace bisector {

// Tetrahedra for TetEdit::replace.
struct TetSwap {
  std::vector<Index> old;
  std::vector<Tetrahedron> fresh;
  double shape = 0;  // the least dihedral_shape of the fresh ones
};

// Each looks for a change that leaves nothing with a dihedral_shape of `best.shape` or less, and that removes
// tetrahedron t. If there is one, the best is put into `best` and true returned.

// Removes an edge, with 3-2 and 4-4 flips as the simplest cases: the best triangulation of the ring around it, by
// dynamic programming (Klincsek 1980).
bool find_edge_removal(const TetEdit& mesh, Index t, TetSwap& best);
// Removes a facet between two vertices, or several that the edge between the two passes through, and puts that edge in,
// with the 2-3 flip as the simplest case.
bool find_face_removal(const TetEdit& mesh, Index t, TetSwap& best);
// Draws a vertex along an edge into the other end. Vertices that are held stay.
bool find_contraction(TetEdit& mesh, Index t, TetSwap& best);

}  // namespace bisector
