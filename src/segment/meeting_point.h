// Where the surfaces of several regions meet.
#pragma once

#include <vector>

#include "bisector/segment.h"
#include "core/geometry.h"

namespace bisector {

struct MeetingSurface {
  const Primitive* surface;
  double error;  // how far the surface may be off, a length
};

// The most likely point, by Gauss-Newton steps, where surfaces meet that are off by their errors, near a point `p` on a
// border that is off by `spread` itself, such as an edge of the mesh: the mesh need have no vertices where the surfaces
// meet. That is the common point or line of surfaces that meet at an angle, and near p where they hardly do.
Vec3 meeting_point(const Vec3& p, const std::vector<MeetingSurface>& surfaces, double spread);

}  // namespace bisector
