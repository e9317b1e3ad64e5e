// Surfaces that regions are approximated by: their type, their parameters, distances and foot points (thesis 2.3.3).
#pragma once

#include <string>

#include "core/geometry.h"
#include "segment/quadric.h"

namespace bisector {

enum class SurfaceType {
  plane,
  sphere,
  cylinder,  // circular
  cone,      // circular
  torus,
  ellipsoid,
  elliptic_paraboloid,
  hyperbolic_paraboloid,
  one_sheet_hyperboloid,
  two_sheet_hyperboloid,
  elliptic_cone,
  elliptic_cylinder,
  hyperbolic_cylinder,
  parabolic_cylinder,
  plane_pair  // two real planes, parallel or not
};

// In lower case, words joined by '_', as in reports.
const char* name_of(SurfaceType type);

struct Primitive {
  SurfaceType type = SurfaceType::plane;
  Quadric quadric;    // the surface's polynomial, of unit gradient or so on the surface; all 0 for a torus
  // plane: centre is the foot point of the origin, axis the unit normal. sphere: centre, radius. cylinder: centre is the
  // point of the axis nearest the origin, axis, radius. cone: centre is the apex, axis points into the nappe with most
  // of the data, angle is half the opening, radians. torus: centre, axis, radius of the centre circle, minor_radius of
  // the tube. Others: centre (centre of symmetry, or vertex of a paraboloid, or a point of a cylinder's axis), axes and
  // lengths a, b, c (0 where there is none) of the canonical equation along them, `axis` being the third of the axes:
  //   ellipsoid, hyperboloids      x^2/a^2 + y^2/b^2 + z^2/c^2 = 1, a >= b >= c; x^2/a^2 + y^2/b^2 - z^2/c^2 = +-1, a >= b
  //   elliptic cone                x^2/a^2 + y^2/b^2 = z^2, c = 1: ratios
  //   paraboloids                  x^2/(2a) +- y^2/(2b) = z: radii of curvature at the vertex
  //   elliptic, hyperbolic, parabolic cylinder  x^2/a^2 +- y^2/b^2 = 1, x^2/(2a) = z (rulings along y)
  //   plane pair                   x^2/a^2 = y^2/b^2, a^2 + b^2 = 1: ratios; or parallel ones x^2 = a^2
  Vec3 centre, axis{0, 0, 1};
  double radius = 0, minor_radius = 0, angle = 0;
  std::array<Vec3, 3> axes{};
  std::array<double, 3> lengths{};
};

// Distance to the surface: exact for plane, sphere, cylinder, cone (both nappes) and torus; for the others
// approximate_distance.
double distance(const Primitive& primitive, const Vec3& p);

// The nearest point of the surface: for general quadrics from the one of the six roots of a polynomial (thesis 2.3.3;
// Fitzgibbon et al. 1997) that belongs to it (Moré 1993, "Generalizations of the trust region problem"). Where several
// points are equally near, one of them. p itself if the surface has no real point.
Vec3 foot_point(const Primitive& primitive, const Vec3& p);

// Axes and normals need not be unit vectors. Throw Error for those without direction, lengths that are not positive, angles
// outside (0, pi/2), and tori whose minor radius is not the smaller one.
Primitive make_plane(const Vec3& normal, double offset);
Primitive make_sphere(const Vec3& centre, double radius);
Primitive make_cylinder(const Vec3& point, const Vec3& axis, double radius);
Primitive make_cone(const Vec3& apex, const Vec3& axis, double angle);
Primitive make_torus(const Vec3& centre, const Vec3& axis, double radius, double minor_radius);

// Type and parameters of a quadric from the eigenvalues of its matrices. What differs from a degenerate or simpler type
// by less than `tolerance`, a length, at the quadric's points in the ball of radius `extent` about `near` becomes that type
// (less nearly circular ones stay elliptic: primitive_fit.h refits them). Polynomials without real zeros become the plane
// that is nearest to being one. Throws Error for coefficients that are not finite and an extent that is not positive.
Primitive classify(const Quadric& quadric, const Vec3& near, double extent, double tolerance);

// The primitive in coordinates x = origin + scale y, for one given in y.
Primitive from_local(const Primitive& local, const Vec3& origin, double scale);

}  // namespace bisector
