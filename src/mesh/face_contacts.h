// Faces in which parts of a surface lie on each other, as those of an assembly do, moved apart.
#pragma once

#include <cstddef>

#include "bisector/mesh.h"

namespace bisector {

// Two triangles of different components, which hang together through vertices, are in contact if they face each other,
// the smaller lies within `rounding` of the plane of the larger, and they overlap there by more than that. Each recedes
// along its normal, with its vertices, until a plane `apart` wide fits between; a vertex of several such triangles
// recedes from all of them. Triangles must run the same way round within a component, as seen from outside. Returns how
// many have receded.
std::size_t open_face_contacts(TriangleMesh& mesh, double rounding, double apart);

}  // namespace bisector
