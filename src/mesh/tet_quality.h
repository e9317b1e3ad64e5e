// Shapes of single tetrahedra.
#pragma once

#include <array>

#include "core/geometry.h"

namespace bisector {

// The six dihedral angles of a tetrahedron of positive volume in degrees, at the edges 01, 02, 03, 12, 13, 23.
std::array<double, 6> dihedral_angles(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// 3 r_in / R_circum with the sign of the volume; 0 where there is none.
double radius_ratio(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

struct TetShape {
  int sign = 0;  // of the volume, exact
  double volume = 0;
  double radius_ratio = 0;
  std::array<double, 6> dihedral{};    // degrees
  double smallest = 0, largest = 180;  // dihedral angles; these are those of tetrahedra without a positive volume
};

TetShape measure_tet(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

}  // namespace bisector
