// Exact signs and roundings behind the filters of the clipped Voronoi diagram; exact.h in one dimension more.
//
// On a tetrahedron (q_0, ..., q_3) in barycentric coordinates, the bisector of seeds (x_i, x_j) is the row
//   h_j[m] = |q_m - x_j|^2 - |q_m - x_i|^2 + (w_i - w_j)(1, 1, 1, 1),   positive on the side of i,
// and the plane of the facet opposite corner m is the unit row e_m. Three rows a, b, c that follow each other
// counter-clockwise around a vertex, seen from outside, meet there, and the side of it with respect to a row d is the
// sign of det(d, a, b, c) over the denominator det(1, a, b, c), which does not vanish and contains no weight. Where the
// determinant's constant part vanishes, the first nonzero cofactor in ascending seed index decides.
#pragma once

#include "core/geometry.h"

namespace bisector {

// One plane on a tetrahedron: the bisector towards a seed, or a facet.
struct ExactPlane {
  Vec3 seed;        // position of the other seed
  Index index = 0;  // of the other seed, in the caller's numbering
  int facet = -1;   // 0..3: the facet opposite that corner, and seed and index are unused

  static ExactPlane bisector(const Vec3& seed, Index index) { return {seed, index, -1}; }
  static ExactPlane tet_facet(int facet) { return {{}, 0, facet}; }
};

// A cell on a positively oriented tetrahedron: what all planes refer to.
struct ExactTetFrame {
  Vec3 corners[4];
  Vec3 seed;
  Index index;
};

// Sign (-1 or +1, never 0) of the perturbed plane `d`, a bisector, at the vertex where a, b and c meet,
// counter-clockwise seen from outside.
int exact_side(const ExactTetFrame& frame, const ExactPlane& a, const ExactPlane& b, const ExactPlane& c,
               const ExactPlane& d);

// The unperturbed vertex where a, b and c meet, relative to the frame's seed, each coordinate the quotient of its exact
// numerator and denominator rounded to double.
Vec3 exact_vertex(const ExactTetFrame& frame, const ExactPlane& a, const ExactPlane& b, const ExactPlane& c);

// det(b - a, c - a, d - a) rounded from its exact value, but never to 0 unless it is 0.
double exact_six_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

}  // namespace bisector
