// The first phase of tetrahedral meshing: the sites find a well-spaced distribution in the solid without any constraint
// (thesis 5.5.2), here from coarse to fine.
#pragma once

#include "tetmesh/stand_ins.h"
#include "tetmesh/tet_run.h"

namespace bisector {

// Makes as many sites as are wanted, or those of the seeds given, and optimises them.
void free_phase(TetRun& run, StandIns& stand_ins);

}  // namespace bisector
