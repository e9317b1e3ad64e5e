// Measures of a tetrahedron's shape and their derivatives, as the improvement of tetrahedral meshes climbs them.
#pragma once

#include "core/geometry.h"

namespace bisector {

// The smallest sine of the six dihedral angles, so that angles near 0 and near 180 degrees count alike: in (0, 1] for
// det(b - a, c - a, d - a) > 0, and 0 otherwise.
double dihedral_shape(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// Sines of the six angles of a positively oriented tetrahedron, and their derivatives by `x`.
struct DihedralSines {
  double value[6];
  Vec3 gradient[6];
};
DihedralSines dihedral_sines(const Vec3& x, const Vec3& b, const Vec3& c, const Vec3& d);

// The radius ratio (mesh/tet_quality.h) and its derivative by `x`; for positively oriented ones.
double radius_ratio(const Vec3& x, const Vec3& b, const Vec3& c, const Vec3& d, Vec3& gradient);

// Smallest and largest dihedral angle, in degrees.
struct DihedralRange {
  double min = 180, max = 0;
};
DihedralRange dihedral_range(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

}  // namespace bisector
