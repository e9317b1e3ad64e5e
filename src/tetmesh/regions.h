// Solids of several regions: their walls, boundary and interfaces, are remeshed as one surface, and what they enclose
// is then filled part by part, so that each interface is meshed once and shared.
#pragma once

#include "bisector/tetmesh.h"
#include "tetmesh/walls.h"

namespace bisector {

// `walls` are the solid's, with interfaces. Slivers are not removed yet. Throws as tetrahedralise(), and Error where
// the walls of the result bound the parts no longer, however many more vertices they get.
TetResult mesh_regions(const TetMesh& mesh, const Walls& walls, const TetOptions& options, const Context& context);

}  // namespace bisector
