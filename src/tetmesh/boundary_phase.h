// The second and third phase of tetrahedral meshing: sites whose cells meet the boundary are put there and held, and
// all are optimised together (thesis 5.5.2); then the boundary alone is finished by the pipeline of surfaces.
#pragma once

#include <cstddef>

#include "tetmesh/tet_run.h"

namespace bisector {

// How the sites are shared out between the boundary and the inside.
struct BoundaryShare {
  double surplus = 0;  // sites that the boundary takes beyond those that its edge lengths ask for
  bool thin = false;   // the solid is thin beside the cells: what comes to the boundary finds no other place
};

struct JointReport {
  std::size_t met_boundary = 0;  // free sites whose cells met the boundary
  bool thin = false;             // as asked for, or because nearly all cells met the boundary
};

// From free sites to sites on the boundary and inside. Of those whose cells meet the boundary at most as many are put
// there as its edge lengths ask for, and the surplus; the others are left out, for match_count of the last phase to
// replace them inside.
// `stand_in`: a solid in which they are optimised instead of the run's, or null.
JointReport joint_phase(TetRun& run, const BoundaryShare& share, SolidBackend* stand_in);

// The finished boundary of the result: a remesh of the solid's boundary from those of the sites that are on it. Throws
// Error if it does not bound a solid.
RemeshResult finish_boundary(TetRun& run);

}  // namespace bisector
