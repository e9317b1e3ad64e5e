// Solids for tests.
#pragma once

#include "bisector/core/types.h"

namespace bisector {

// The unit cube as n^3 cubes of six tetrahedra each (Kuhn), positively oriented.
TetMesh tet_box(int n);

}  // namespace bisector
