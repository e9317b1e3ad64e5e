// Meshes with every triangle once.
#pragma once

#include "bisector/repair.h"

namespace bisector {

// Of triangles with the same three vertices, either way round, keeps the first of the lowest label. No vertices are
// merged. Faces that are to be seen from both sides are often written twice; seeds cannot tell the same sheet from
// itself.
WeldResult remove_double_triangles(const TriangleMesh& mesh);

}  // namespace bisector
