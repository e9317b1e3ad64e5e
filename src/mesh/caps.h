// Triangles lower than rounding over their longest edge, whose corner lies on that edge but for it.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// Flips the longest edge of triangles that are lower over it than `height` and than a thousandth of its length, or that
// are lower than `fold` and than a tenth, face the other way than all three neighbours and lie on the one there, the
// lowest first: the neighbour is divided where the corner lies, and gives both parts its label and its
// face_of_triangle, so the surface moves by `height` or `fold` at most. Not where the edge has not two triangles, is
// one of those `given` or of the mesh's feature edges, where the other diagonal is an edge already, and where that
// would turn a part over or leave one that is as low. Returns how many edges were flipped.
std::size_t flip_caps(TriangleMesh& mesh, double height, double fold, const std::vector<std::array<Index, 2>>& given);

}  // namespace bisector
