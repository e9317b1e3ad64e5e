// What exact predicates on triangles and tetrahedra share. For sources that use CGAL.
#pragma once

#include <CGAL/Mpzf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

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

// The perturbed sign of a determinant whose constant part vanishes: that of its first nonzero cofactor in ascending
// seed index, or 0.
template <std::size_t kMost>
class Cofactors {
 public:
  // `value` is the cofactor of the weight of the seed `index`.
  void add(Index index, const Exact& value) {
    std::size_t k = count_++;
    for (; k > 0 && terms_[k - 1].index > index; --k) terms_[k] = terms_[k - 1];
    terms_[k] = {index, value};
  }
  int sign() const {
    for (std::size_t k = 0; k < count_; ++k)
      if (const int s = bisector::sign(terms_[k].value)) return s;
    return 0;
  }

 private:
  struct Term {
    Index index;
    Exact value;
  };
  std::array<Term, kMost> terms_;
  std::size_t count_ = 0;
};

// Brings coordinates near 1, by a power of two, which keeps the numerators and denominators of vertices within the
// range of double.
class ExactScaling {
 public:
  // For what lies about as far from the seed as the corners do.
  template <std::size_t kCorners>
  ExactScaling(const Vec3 (&corners)[kCorners], const Vec3& seed) {
    double largest = 0;
    for (const Vec3& q : corners)
      for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(q[k] - seed[k]));
    exponent_ = std::ilogb(largest);
  }
  Vec3 scaled(const Vec3& p) const {
    return {std::ldexp(p.x, -exponent_), std::ldexp(p.y, -exponent_), std::ldexp(p.z, -exponent_)};
  }
  template <class Frame>
  Frame scaled_frame(Frame frame) const {
    for (Vec3& q : frame.corners) q = scaled(q);
    frame.seed = scaled(frame.seed);
    return frame;
  }
  // The same of a line or plane.
  template <class Bound>
  Bound scaled_bound(Bound bound) const {
    bound.seed = scaled(bound.seed);
    return bound;
  }
  double restored(double coordinate) const { return std::ldexp(coordinate, exponent_); }

 private:
  int exponent_;
};

}  // namespace bisector
