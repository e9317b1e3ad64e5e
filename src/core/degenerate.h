// Whether a triangle has an area, decided exactly, and how large it is.
#pragma once

#include "core/geometry.h"

namespace bisector {

// Exact for all finite doubles; true also for repeated points.
bool collinear(const Vec3& a, const Vec3& b, const Vec3& c);

// Area of a triangle whose coordinates are at most 1e100; 0 if and only if the corners are exactly collinear.
double triangle_area(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace bisector
