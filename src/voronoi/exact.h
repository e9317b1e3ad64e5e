// Exact signs and roundings behind the filters of the restricted Voronoi diagram.
//
// On a triangle (q_0, q_1, q_2) in barycentric coordinates, the bisector of seeds (x_i, x_j) is the row
//   h_j[m] = |q_m - x_j|^2 - |q_m - x_i|^2 + (w_i - w_j)(1, 1, 1),   positive on the side of i,
// and the line through the edge opposite corner m is the unit row e_m. Two consecutive rows a, b of a convex polygon in
// counter-clockwise order meet at the point a x b with denominator det(1, a, b) > 0, so the side of that point
// with respect to a row c is the sign of det(c, a, b): degree 2, 4 and 6 for vertices of type A, B and C
// (thesis 4.3.4). The determinant is affine in the infinitesimal weights w_0 >> w_1 >> ... > 0 (simulation of
// simplicity, Edelsbrunner and Muecke 1990): where its constant part vanishes, the first nonzero cofactor in ascending
// seed index decides.
#pragma once

#include "core/geometry.h"

namespace bisector {

// One line on a triangle: the bisector towards a seed, or the edge opposite a corner.
struct ExactLine {
  Vec3 seed;        // position of the other seed
  Index index = 0;  // of the other seed, in the caller's numbering
  int corner = -1;  // 0..2: the edge opposite that corner, and seed and index are unused

  static ExactLine bisector(const Vec3& seed, Index index) { return {seed, index, -1}; }
  static ExactLine edge(int corner) { return {{}, 0, corner}; }
};

// A cell on a triangle: what all lines refer to.
struct ExactFrame {
  Vec3 corners[3];
  Vec3 seed;
  Index index;
};

// Sign (-1 or +1, never 0) of the perturbed line `c`, a bisector, at the vertex where `a` and then `b` meet.
int exact_side(const ExactFrame& frame, const ExactLine& a, const ExactLine& b, const ExactLine& c);

// Sign (-1 or +1) of |q - x_j|^2 - |q - x_i|^2 + w_i - w_j: +1 where q belongs to i rather than j.
int exact_side(const Vec3& q, const Vec3& x_i, Index i, const Vec3& x_j, Index j);

// The unperturbed vertex where `a` and then `b` meet, relative to the frame's seed, each coordinate the quotient of its
// exact numerator and denominator rounded to double.
Vec3 exact_vertex(const ExactFrame& frame, const ExactLine& a, const ExactLine& b);

// (b - a) x (c - a) rounded from its exact value; the zero vector exactly when the corners are collinear.
Vec3 exact_normal(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace bisector
