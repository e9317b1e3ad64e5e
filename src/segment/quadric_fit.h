// Least squares fits of planes and quadrics to pieces of surface, from moments that add up (thesis 2.2.3,
// appendix 2.5).
#pragma once

#include <array>

#include "core/geometry.h"
#include "segment/quadric.h"

namespace bisector {

// Integrals over a piece of surface of the 35 monomials in p - origin up to degree four. All entries of the thesis'
// matrices M_t and N_t are among them, up to a factor.
struct SurfaceMoments {
  static constexpr std::size_t kCount = 35;
  Vec3 origin;
  std::array<double, kCount> m{};
  // Integrals of the triangles' unit normal n, and of n times each coordinate of p - origin: flux[1 + k] is n (p -
  // origin)_k.
  std::array<Vec3, 4> flux{};

  double area() const { return m[0]; }
  Vec3 centroid() const;  // the origin if there is no area
};

// Position of the monomial x^i y^j z^k, i + j + k <= 4.
std::size_t monomial_index(int i, int j, int k);

// In closed form; exact up to rounding.
SurfaceMoments triangle_moments(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& origin);
// The same integrals about another origin.
SurfaceMoments moved(const SurfaceMoments& moments, const Vec3& origin);
// Of the union, about the centroid of both.
SurfaceMoments merged(const SurfaceMoments& a, const SurfaceMoments& b);

struct PlaneFit {
  Vec3 normal{0, 0, 1};         // unit
  double offset = 0;            // dot(normal, p) = offset
  double squared_distance = 0;  // integral over the piece
};
PlaneFit fit_plane(const SurfaceMoments& moments);

struct QuadricFit {
  Quadric quadric;
  double squared_distance = 0;  // integral of Taubin's first-order approximation, C'MC / C'NC times the area (Eq. 2.5)
  // Mean of n . grad f over the root mean square of |grad f|, so within [-1, 1]: near 0 where the gradient does not
  // keep to one side of the surface, as between the sheets of a double surface. Of oriented triangles.
  double alignment = 0;
  bool valid = false;  // false: the piece is too small or too flat to span a quadric
};
// The eigenvector of M - lambda N of the least eigenvalue. Where N is singular, as for a piece of a plane, directions
// of C that it does not see are left out.
QuadricFit fit_quadric(const SurfaceMoments& moments);
// The same with the square of the integral of n . grad f in place of C'NC: what keeps to one side of the surface is
// preferred.
QuadricFit fit_oriented_quadric(const SurfaceMoments& moments);

}  // namespace bisector
