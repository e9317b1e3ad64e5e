// Cylinders of sections of branches (thesis 3.2.3).
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

struct BranchCylinder {
  Vec3 centre;                 // on the axis, in the middle of the points along it
  Vec3 axis;                   // of length 1
  double radius = 0;           // least squares; at most twice the bounding one
  double bounding_radius = 0;  // of the smallest circle around the points' projections along the axis
  double length = 0;           // of the points along the axis
  double rms = 0;              // distance of the points from the surface of radius `radius`
};

// The cylinder of points along `axis`, or along their principal direction where it is zero. The thesis takes the
// bounding circle for the cylinder; noise makes it too large and points on one side only move it off the axis, so here
// it only bounds the circle of least squares. Points that are all equal give a cylinder without extent.
BranchCylinder fit_cylinder(const std::vector<Vec3>& points, Vec3 axis = {});

}  // namespace bisector
