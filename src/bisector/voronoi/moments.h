// Closed-form moments of triangles with a linear density: mass, first moment and second moment about the origin.
#pragma once

#include "bisector/core/types.h"

namespace bisector {

struct Moments {
  double mass = 0;    // integral of rho
  Vec3 first;         // integral of rho p
  double second = 0;  // integral of rho |p|^2

  Moments& operator+=(const Moments& b) {
    mass += b.mass;
    first += b.first;
    second += b.second;
    return *this;
  }
};

// Quotients are products with rounded reciprocals, for not every device divides as the CPU does.
inline constexpr double kThird = 1.0 / 3, kTwelfth = 1.0 / 12, kThirtieth = 1.0 / 30;

// The moments about x of a shape whose moments about `origin` are m; `to_origin` is origin - x.
inline Moments moved(const Moments& m, const Vec3& to_origin) {
  return {m.mass, m.mass * to_origin + m.first,
          m.mass * norm2(to_origin) + 2 * dot(to_origin, m.first) + m.second};
}

// Moments of a triangle of signed area `area` with density 1, from the sum of its corners and of their squared lengths.
inline Moments triangle_moments(const Vec3& sum, double squares, double area) {
  return {area, (kThird * area) * sum, (kTwelfth * area) * (norm2(sum) + squares)};
}

// Moments of the triangle (a, b, c) with the density linear, ra, rb and rc at the corners.
inline Moments triangle_moments(const Vec3& a, const Vec3& b, const Vec3& c, double ra, double rb, double rc, double area) {
  const double s = ra + rb + rc;
  const Vec3 first = (s + ra) * a + (s + rb) * b + (s + rc) * c;
  const double squares = (s + ra + ra) * norm2(a) + (s + rb + rb) * norm2(b) + (s + rc + rc) * norm2(c);
  const double products = (s + ra + rb) * dot(a, b) + (s + rb + rc) * dot(b, c) + (s + rc + ra) * dot(c, a);
  return {(kThird * area) * s, (kTwelfth * area) * first, (kThirtieth * area) * (squares + products)};
}

}  // namespace bisector
