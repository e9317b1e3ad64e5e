// Normals of primitives.
#pragma once

#include "bisector/segment.h"
#include "core/geometry.h"

namespace bisector {

// The surface's own normal at p, a point of it, of length 1: that of a plane, away from the centre of a sphere, from
// the axis of a cylinder or a cone and from the middle of a torus' tube, along the gradient of a general quadric's
// polynomial. 0 where there is none, as at an apex.
Vec3 surface_normal(const Primitive& surface, const Vec3& p);

}  // namespace bisector
