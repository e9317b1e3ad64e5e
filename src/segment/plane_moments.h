// What tells how flat a piece of surface is, for many small pieces.
#pragma once

#include <array>

#include "core/geometry.h"
#include "segment/segment_domain.h"

namespace bisector {

// Area, first and second moments, about the origin of the unit-sized model.
struct PlaneMoments {
  double area = 0;
  Vec3 first;
  std::array<double, 6> second{};  // xx xy xz yy yz zz

  void add(const PlaneMoments& b);
  // Integral of the squared distance to the best plane.
  double squared_distance() const;
};

PlaneMoments plane_moments(const SegmentDomain& domain, Index triangle);

}  // namespace bisector
