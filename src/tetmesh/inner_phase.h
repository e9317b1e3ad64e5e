// The last phase of tetrahedral meshing: with the boundary finished, the sites inside are optimised once more, and none
// of them is left with a part of the boundary.
#pragma once

#include <vector>

#include "tetmesh/tet_run.h"

namespace bisector {

// The boundary's vertices, which do not move, and the sites inside: sites are added where cells are large or removed
// where they are crowded, to come to the number wanted. The state is complete.
CvtState inner_phase(TetRun& run, const RemeshResult& surface, const std::vector<Vec3>& inside);

}  // namespace bisector
