#include "voronoi/exact_tet.h"

#include <array>
#include <limits>

#include "voronoi/exact_arithmetic.h"

namespace bisector {
namespace {

using Row = std::array<Exact, 4>;

// The generalised cross product: dot(d, cross(a, b, c)) = det(d, a, b, c).
Row cross(const Row& a, const Row& b, const Row& c) {
  const auto minor = [&](std::size_t k, std::size_t l) { return b[k] * c[l] - b[l] * c[k]; };
  const Exact m01 = minor(0, 1), m02 = minor(0, 2), m03 = minor(0, 3), m12 = minor(1, 2), m13 = minor(1, 3),
              m23 = minor(2, 3);
  return {a[1] * m23 - a[2] * m13 + a[3] * m12, a[2] * m03 - a[0] * m23 - a[3] * m02,
          a[0] * m13 - a[1] * m03 + a[3] * m01, a[1] * m02 - a[0] * m12 - a[2] * m01};
}

Exact dot(const Row& a, const Row& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }

// The rows of planes, in barycentric coordinates or, where only bisectors take part, as coefficients of (p - x_i, 1),
// of lower degree. The latter basis has the opposite orientation, so `unit` carries the sign that makes denominators
// positive.
struct Basis {
  const ExactTetFrame& frame;
  bool euclidean;

  Row row(const ExactPlane& plane) const {
    Row row{Exact(0), Exact(0), Exact(0), Exact(0)};
    if (plane.facet >= 0) {
      row[static_cast<std::size_t>(plane.facet)] = Exact(1);
    } else if (euclidean) {
      for (int k = 0; k < 3; ++k) {
        const Exact d = Exact(plane.seed[k]) - Exact(frame.seed[k]);
        row[static_cast<std::size_t>(k)] = Exact(-2.0) * d;
        row[3] = row[3] + d * d;
      }
    } else {
      for (std::size_t m = 0; m < 4; ++m) row[m] = difference_of_squares(frame.corners[m], frame.seed, plane.seed);
    }
    return row;
  }
  Row constant() const {
    const Exact one(euclidean ? 0 : 1);
    return {one, one, one, Exact(1)};
  }
  int unit() const { return euclidean ? 1 : -1; }
};

bool is_bisector(const ExactPlane& plane) { return plane.facet < 0; }

}  // namespace

int exact_side(const ExactTetFrame& frame, const ExactPlane& plane_a, const ExactPlane& plane_b,
               const ExactPlane& plane_c, const ExactPlane& plane_d) {
  const Basis basis{frame, is_bisector(plane_a) && is_bisector(plane_b) && is_bisector(plane_c)};
  const Row a = basis.row(plane_a), b = basis.row(plane_b), c = basis.row(plane_c), d = basis.row(plane_d);
  const Row lambda = cross(a, b, c);
  if (const int s = sign(dot(d, lambda))) return s * basis.unit();

  // det(d + e_d 1, a + e_a 1, ...) with e_k = w_i - w_k: each seed's row contributes its cofactor to w_i.
  Cofactors<5> cofactors;
  const Row one = basis.constant();
  Exact own = 0;
  const auto add = [&](const ExactPlane& plane, const Exact& value) {
    if (!is_bisector(plane)) return;
    own = own + value;
    cofactors.add(plane.index, -value);
  };
  add(plane_d, dot(one, lambda));
  add(plane_a, dot(d, cross(one, b, c)));
  add(plane_b, dot(d, cross(a, one, c)));
  add(plane_c, dot(d, cross(a, b, one)));
  cofactors.add(frame.index, own);
  if (const int s = cofactors.sign()) return s * basis.unit();
  return plane_d.index < frame.index ? -1 : 1;  // unreachable for a vertex of a polyhedron: its denominator is not 0
}

Vec3 exact_vertex(const ExactTetFrame& given, const ExactPlane& given_a, const ExactPlane& given_b,
                  const ExactPlane& given_c) {
  const ExactScaling scaling(given.corners, given.seed);
  const ExactTetFrame frame = scaling.scaled_frame(given);
  const ExactPlane a = scaling.scaled_bound(given_a), b = scaling.scaled_bound(given_b),
                   c = scaling.scaled_bound(given_c);

  const Basis basis{frame, is_bisector(a) && is_bisector(b) && is_bisector(c)};
  const Row lambda = cross(basis.row(a), basis.row(b), basis.row(c));
  const double denominator = CGAL::to_double(dot(basis.constant(), lambda));
  Vec3 local;
  for (int k = 0; k < 3; ++k) {
    Exact numerator = 0;
    if (basis.euclidean) numerator = lambda[static_cast<std::size_t>(k)];
    else
      for (std::size_t m = 0; m < 4; ++m)
        numerator = numerator + lambda[m] * (Exact(frame.corners[m][k]) - Exact(frame.seed[k]));
    local[k] = scaling.restored(CGAL::to_double(numerator) / denominator);
  }
  return local;
}

double exact_six_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  std::array<std::array<Exact, 3>, 3> e;
  const Vec3* ends[3] = {&b, &c, &d};
  for (std::size_t r = 0; r < 3; ++r)
    for (int k = 0; k < 3; ++k) e[r][static_cast<std::size_t>(k)] = Exact((*ends[r])[k]) - Exact(a[k]);
  const Exact volume = e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
                       e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
                       e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
  const double rounded = CGAL::to_double(volume);
  return rounded != 0 ? rounded : sign(volume) * std::numeric_limits<double>::denorm_min();
}

}  // namespace bisector
