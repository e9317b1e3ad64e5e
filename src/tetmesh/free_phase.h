// The first phase of tetrahedral meshing: the sites find a well-spaced distribution in the solid without any constraint
// (thesis 5.5.2), here from coarse to fine.
#pragma once

#include <vector>

#include "tetmesh/stand_ins.h"
#include "tetmesh/tet_run.h"

namespace bisector {

// As many sites as are wanted, or the seeds given, optimised.
std::vector<Vec3> free_phase(TetRun& run, StandIns& stand_ins);

}  // namespace bisector
