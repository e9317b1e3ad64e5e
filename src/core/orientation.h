// Exact signs of areas and volumes.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

// Sign (-1, 0, +1) of det(b - a, c - a, d - a), exact for all finite doubles. Positive if b, c, d run counter-clockwise
// seen from the side away from a.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// Sign of the area of the projections of a, b, c along the x axis: positive if they turn left, y to the right and z
// upwards.
int orientation_yz(const Vec3& a, const Vec3& b, const Vec3& c);

// Sign of the volume that closed triangles enclose: positive if they are counter-clockwise seen from outside. Exact.
int enclosed_volume_sign(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles);

}  // namespace bisector
