// Arithmetic of quadric surfaces, zero sets of second-degree polynomials (thesis 2.2.2, Eq. 2.2).
#pragma once

#include <cmath>

#include "bisector/segment.h"
#include "core/geometry.h"

namespace bisector {

inline double value_of(const Quadric& q, const Vec3& p) {
  const auto& c = q.c;
  return c[0] + p.x * (c[1] + c[4] * p.x + c[5] * p.y + c[6] * p.z) + p.y * (c[2] + c[7] * p.y + c[8] * p.z) +
         p.z * (c[3] + c[9] * p.z);
}

inline Vec3 gradient_of(const Quadric& q, const Vec3& p) {
  const auto& c = q.c;
  return {c[1] + 2 * c[4] * p.x + c[5] * p.y + c[6] * p.z, c[2] + c[5] * p.x + 2 * c[7] * p.y + c[8] * p.z,
          c[3] + c[6] * p.x + c[8] * p.y + 2 * c[9] * p.z};
}

// Frobenius norm of the matrix of the second-degree terms.
inline double second_order_of(const Quadric& q) {
  const auto& c = q.c;
  return std::sqrt(c[4] * c[4] + c[7] * c[7] + c[9] * c[9] + 0.5 * (c[5] * c[5] + c[6] * c[6] + c[8] * c[8]));
}

inline Quadric plane_quadric(const Vec3& normal, double offset) { return {{-offset, normal.x, normal.y, normal.z}}; }

// Taubin's second-order approximation of the distance from p to the quadric, between 0 and the exact one (thesis 2.2.2;
// Taubin 1993). `second_order` is the quadric's. The root of the quadratic equation is written so that planes are no
// special case.
inline double approximate_distance(const Quadric& q, double second_order, const Vec3& p) {
  const double c = std::abs(value_of(q, p)), b2 = norm2(gradient_of(q, p)), b = std::sqrt(b2);
  const double denominator = b + std::sqrt(b2 + 4 * second_order * c);
  return denominator > 0 ? 2 * c / denominator : 0;
}

// The quadric of f((x - origin) / scale), for f in coordinates that have been moved and scaled so.
Quadric from_local(const Quadric& local, const Vec3& origin, double scale);

// The quadric whose polynomial at (x - origin) / scale is f's at x.
Quadric to_local(const Quadric& quadric, const Vec3& origin, double scale);

}  // namespace bisector
