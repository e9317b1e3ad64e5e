#include "voronoi/exact.h"

#include <array>

#include "voronoi/exact_arithmetic.h"

namespace bisector {
namespace {

using Row = std::array<Exact, 3>;

Row row_of(const ExactFrame& frame, const ExactLine& line) {
  Row row{Exact(0), Exact(0), Exact(0)};
  if (line.corner >= 0) {
    row[line.corner] = Exact(1);
  } else {
    for (int m = 0; m < 3; ++m) row[m] = difference_of_squares(frame.corners[m], frame.seed, line.seed);
  }
  return row;
}

Row cross(const Row& a, const Row& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Exact dot(const Row& a, const Row& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Exact total(const Row& a) { return a[0] + a[1] + a[2]; }

}  // namespace

int exact_side(const ExactFrame& frame, const ExactLine& line_a, const ExactLine& line_b, const ExactLine& line_c) {
  const Row a = row_of(frame, line_a), b = row_of(frame, line_b), c = row_of(frame, line_c);
  const Row lambda = cross(a, b);
  if (const int s = sign(dot(c, lambda))) return s;

  // det(c + e_c 1, a + e_a 1, b + e_b 1) with e_k = w_i - w_k: each seed's row contributes its cofactor to w_i.
  Cofactors<4> cofactors;
  Exact own = 0;
  const auto add = [&](const ExactLine& line, const Exact& value) {
    if (line.corner >= 0) return;
    own = own + value;
    cofactors.add(line.index, -value);
  };
  add(line_c, total(lambda));
  add(line_a, total(cross(b, c)));
  add(line_b, total(cross(c, a)));
  cofactors.add(frame.index, own);
  if (const int s = cofactors.sign()) return s;
  return line_c.index < frame.index ? -1 : 1;  // unreachable for a vertex of a polygon: its denominator is not 0
}

int exact_side(const Vec3& q, const Vec3& x_i, Index i, const Vec3& x_j, Index j) {
  if (const int s = sign(difference_of_squares(q, x_i, x_j))) return s;
  return i < j ? 1 : -1;
}

Vec3 exact_vertex(const ExactFrame& given, const ExactLine& given_a, const ExactLine& given_b) {
  const ExactScaling scaling(given.corners, given.seed);
  const ExactFrame frame = scaling.scaled_frame(given);
  const ExactLine a = scaling.scaled_bound(given_a), b = scaling.scaled_bound(given_b);

  const Row lambda = cross(row_of(frame, a), row_of(frame, b));
  const double denominator = CGAL::to_double(total(lambda));
  Vec3 local;
  for (int k = 0; k < 3; ++k) {
    Exact numerator = 0;
    for (int m = 0; m < 3; ++m) numerator = numerator + lambda[m] * (Exact(frame.corners[m][k]) - Exact(frame.seed[k]));
    local[k] = scaling.restored(CGAL::to_double(numerator) / denominator);
  }
  return local;
}

Vec3 exact_normal(const Vec3& a, const Vec3& b, const Vec3& c) {
  Row u, v;
  for (int k = 0; k < 3; ++k) {
    u[k] = Exact(b[k]) - Exact(a[k]);
    v[k] = Exact(c[k]) - Exact(a[k]);
  }
  const Row n = cross(u, v);
  return {CGAL::to_double(n[0]), CGAL::to_double(n[1]), CGAL::to_double(n[2])};
}

}  // namespace bisector
