// Pictures of tetrahedral meshes.
#pragma once

#include <string>

#include "core/geometry.h"

namespace bisector {

// Renders the mesh (preview.h) without the tetrahedra of the half that faces the camera, those inside in another colour.
// Throws Error if the file cannot be written.
void write_tet_preview(const std::string& path, const TetMesh& mesh);

}  // namespace bisector
