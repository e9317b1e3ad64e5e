// The last phase of tetrahedral meshing: with the boundary finished, the sites inside are optimised once more, and none
// of them is left with a part of the boundary.
#pragma once

#include "tetmesh/tet_run.h"

namespace bisector {

// The vertices of the finished boundary take the place of the sites that were on it, and do not move. Sites inside are
// added where cells are large or removed where they are crowded, to come to the number wanted. `stand_in`: a solid in
// which they are optimised instead of the run's, or null.
void inner_phase(TetRun& run, const RemeshResult& surface, SolidBackend* stand_in);

}  // namespace bisector
