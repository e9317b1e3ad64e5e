// A new vertex in place of a poor tetrahedron.
#pragma once

#include <vector>

#include "tetmesh/tet_edit.h"

namespace bisector {

// A cavity and the point that its facets are joined to.
struct TetInsertion {
  Vec3 point;
  std::vector<Index> old;
  std::vector<Triangle> facets;  // each positive with the point before it
  double shape = 0;              // the least dihedral_shape with the point
};

// For points within tetrahedron t and in the middle of its inner facets and edges: the tetrahedra at the point, and
// more of those around as long as that mends the worst of the facets' tetrahedra. Best first; those with a shape of 0
// are left out.
std::vector<TetInsertion> find_insertions(TetEdit& mesh, Index t);

}  // namespace bisector
