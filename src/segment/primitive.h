// Making, classifying and moving the surfaces that regions are approximated by (thesis 2.3.3).
#pragma once

#include <utility>

#include "bisector/segment.h"
#include "core/geometry.h"
#include "segment/quadric.h"

namespace bisector {

// Two vectors u and v of length 1, so that (u, v, axis) is right-handed and orthonormal; the axis has length 1.
std::pair<Vec3, Vec3> frame_across(const Vec3& axis);

// p turned about the origin by |w| radians, about the direction of w (Rodrigues' formula).
Vec3 rotated(const Vec3& p, const Vec3& w);

// Axes and normals need not have length 1. Throw Error for those without direction, lengths that are not positive,
// angles outside (0, pi/2), and tori whose minor radius is not the smaller one.
Plane make_plane(const Vec3& normal, double offset);
Sphere make_sphere(const Vec3& centre, double radius);
Cylinder make_cylinder(const Vec3& point, const Vec3& axis, double radius);
Cone make_cone(const Vec3& apex, const Vec3& axis, double angle);
Torus make_torus(const Vec3& centre, const Vec3& axis, double radius, double minor_radius);

// Type and parameters of a quadric from the eigenvalues of its matrices. What differs from a degenerate or simpler type
// by less than `tolerance`, a length, at the quadric's points in the ball of radius `extent` about `near` becomes that
// type (less nearly circular ones stay elliptic: primitive_fit.h refits them). Polynomials without real zeros become
// the plane that is nearest to being one. Throws Error for coefficients that are not finite and an extent that is not
// positive.
Primitive classify(const Quadric& quadric, const Vec3& near, double extent, double tolerance);

// The primitive in coordinates x = origin + scale y, for one given in y.
Primitive from_local(const Primitive& local, const Vec3& origin, double scale);

}  // namespace bisector
