// Closed-form moments of triangles and tetrahedra with a linear density: mass, first moment and second moment about the
// origin.
#pragma once

#include "core/geometry.h"

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
inline constexpr double kSixth = 1.0 / 6, kTwentyFourth = 1.0 / 24, kOneHundredTwentieth = 1.0 / 120;

// The moments about x of a shape whose moments about `origin` are m; `to_origin` is origin - x.
inline Moments moved(const Moments& m, const Vec3& to_origin) {
  return {m.mass, m.mass * to_origin + m.first, m.mass * norm2(to_origin) + 2 * dot(to_origin, m.first) + m.second};
}

// Moments of a triangle of signed area `area` with density 1, from the sum of its corners and of their squared lengths.
inline Moments triangle_moments(const Vec3& sum, double squares, double area) {
  return {area, (kThird * area) * sum, (kTwelfth * area) * (norm2(sum) + squares)};
}

// Moments of the triangle (a, b, c) with the density linear, ra, rb and rc at the corners.
inline Moments triangle_moments(const Vec3& a, const Vec3& b, const Vec3& c, double ra, double rb, double rc,
                                double area) {
  const double s = ra + rb + rc;
  const Vec3 first = (s + ra) * a + (s + rb) * b + (s + rc) * c;
  const double squares = (s + ra + ra) * norm2(a) + (s + rb + rb) * norm2(b) + (s + rc + rc) * norm2(c);
  const double products = (s + ra + rb) * dot(a, b) + (s + rb + rc) * dot(b, c) + (s + rc + ra) * dot(c, a);
  return {(kThird * area) * s, (kTwelfth * area) * first, (kThirtieth * area) * (squares + products)};
}

// Moments of a tetrahedron with one corner at the origin, the others a, b, c, and density 1, times 6, 24 and 120: what
// is to be added up of many. `six_volume` is det(a, b, c).
inline Moments tet_terms(const Vec3& a, const Vec3& b, const Vec3& c, double six_volume) {
  const Vec3 sum = a + b + c;
  return {six_volume, six_volume * sum, six_volume * (norm2(sum) + (norm2(a) + norm2(b) + norm2(c)))};
}

// The same times 24, 120 and 360 with the density linear, r0 at the origin and ra, rb and rc at the other corners:
// integrals of products of barycentric coordinates are 6 V alpha! / (3 + |alpha|)!.
inline Moments tet_terms(const Vec3& a, const Vec3& b, const Vec3& c, double r0, double ra, double rb, double rc,
                         double six_volume) {
  const double s = ((r0 + ra) + rb) + rc;
  const Vec3 first = (s + ra) * a + (s + rb) * b + (s + rc) * c;
  const double squares = (s + ra + ra) * norm2(a) + (s + rb + rb) * norm2(b) + (s + rc + rc) * norm2(c);
  const double products = (s + ra + rb) * dot(a, b) + (s + rb + rc) * dot(b, c) + (s + rc + ra) * dot(c, a);
  return {six_volume * s, six_volume * first, six_volume * (squares + products)};
}

// The moments whose terms add up to `sum`.
template <bool kUniform>
Moments scaled_terms(const Moments& sum) {
  if constexpr (kUniform) return {kSixth * sum.mass, kTwentyFourth * sum.first, kOneHundredTwentieth * sum.second};
  else return {kTwentyFourth * sum.mass, kOneHundredTwentieth * sum.first, (1.0 / 360) * sum.second};
}

}  // namespace bisector
