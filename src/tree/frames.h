// Rotation-minimising frames along curves by double reflection (Wang, Juettler, Zheng and Liu, Computation of Rotation
// Minimizing Frames, 2008).
#pragma once

#include <vector>

#include "core/geometry.h"
#include "tree/bspline.h"

namespace bisector {

struct Frame {
  Vec3 position, tangent, normal, binormal;  // orthonormal, right-handed: tangent = normal x binormal
};

// At the given parameters, in [0, 1] and ascending. Steps in between are halved until the normals' rotation about the
// tangent is that of the rotation-minimising frame (Bishop 1975) within 1e-6 radians over the whole curve. The first
// normal is perpendicular to the coordinate axis that the tangent is farthest from. Where the derivative vanishes the
// tangent is that just before. Throws Error for parameters out of order or range.
std::vector<Frame> rotation_minimising_frames(const BSplineCurve& curve, const std::vector<double>& parameters);

}  // namespace bisector
