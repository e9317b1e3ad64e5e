// What exact predicates on triangles and tetrahedra share. For sources that use CGAL.
#pragma once

#include <CGAL/Mpzf.h>

#include "core/geometry.h"

namespace bisector {

using Exact = CGAL::Mpzf;

inline int sign(const Exact& x) { return static_cast<int>(CGAL::sign(x)); }

// |q - x_j|^2 - |q - x_i|^2.
inline Exact difference_of_squares(const Vec3& q, const Vec3& x_i, const Vec3& x_j) {
  Exact sum = 0;
  for (int k = 0; k < 3; ++k)
    sum = sum + (Exact(x_j[k]) - Exact(x_i[k])) * (Exact(x_j[k]) + Exact(x_i[k]) - Exact(2.0) * Exact(q[k]));
  return sum;
}

}  // namespace bisector
