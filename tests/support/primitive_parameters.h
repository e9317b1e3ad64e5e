// The parameters of any primitive in the same fields, to compare them.
#pragma once

#include <array>

#include "bisector/segment.h"
#include "core/geometry.h"

namespace bisector::test {

// A plane's centre is its point nearest the origin, a cone's its apex, a cylinder's a point of its axis; the axis of a
// general quadric is its third. What a type has not is 0.
struct PrimitiveParameters {
  SurfaceType type;
  Vec3 centre, axis{0, 0, 1};
  double radius = 0, minor_radius = 0, angle = 0;
  std::array<Vec3, 3> axes{};
  std::array<double, 3> lengths{};
};

inline PrimitiveParameters parameters_of(const Primitive& primitive) {
  PrimitiveParameters p{type_of(primitive), {}};
  if (const auto* plane = std::get_if<Plane>(&primitive)) {
    p.centre = plane->offset * plane->normal;
    p.axis = plane->normal;
  } else if (const auto* sphere = std::get_if<Sphere>(&primitive)) {
    p.centre = sphere->centre;
    p.radius = sphere->radius;
  } else if (const auto* cylinder = std::get_if<Cylinder>(&primitive)) {
    p.centre = cylinder->point;
    p.axis = cylinder->axis;
    p.radius = cylinder->radius;
  } else if (const auto* cone = std::get_if<Cone>(&primitive)) {
    p.centre = cone->apex;
    p.axis = cone->axis;
    p.angle = cone->angle;
  } else if (const auto* torus = std::get_if<Torus>(&primitive)) {
    p.centre = torus->centre;
    p.axis = torus->axis;
    p.radius = torus->radius;
    p.minor_radius = torus->minor_radius;
  } else {
    const auto& quadric = std::get<GeneralQuadric>(primitive);
    p.centre = quadric.centre;
    p.axis = quadric.axes[2];
    p.axes = quadric.axes;
    p.lengths = quadric.lengths;
  }
  return p;
}

}  // namespace bisector::test
