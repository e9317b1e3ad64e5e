// Surfaces of regions for OpenCASCADE.
#pragma once

#include <Geom_Surface.hxx>
#include <vector>

#include "bisector/segment.h"
#include "core/geometry.h"

namespace bisector::step {

struct Outline {
  std::vector<std::vector<Vec3>> loops;
  std::vector<Vec3> points;  // of all loops
  double area = 0;           // of the region
};

// The surface, large enough for a region with this outline: a plane, cylinder, cone, sphere or torus as
// such, general cylinders as extrusions and other quadrics as exact rational B-splines. Its normal (du x dv) points
// where the primitive's own does if `flipped` comes back false. Seams and poles are far from the outline where that can
// be had. Null for a pair of planes.
Handle(Geom_Surface) make_surface(const Primitive& surface, const Outline& outline, bool& flipped);

// A general quadric as a B-spline height field above the plane of its outer loop, for regions that lie above it once
// and whose exact form is too ill-shaped to trim. `same_sense` is the region's.
Handle(Geom_Surface) make_patch(const GeneralQuadric& quadric, const Outline& outline, bool same_sense, bool& flipped);

}  // namespace bisector::step
