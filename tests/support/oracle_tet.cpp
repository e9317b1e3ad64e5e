#include "support/oracle_tet.h"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

namespace bisector::test {
namespace {

using Point = std::array<mpz_class, 3>;
using RationalPoint = std::array<mpq_class, 3>;

// A coordinate as an integer times 2^-shift.
constexpr int kLowestBit = -160;

mpz_class exact_integer(double value) {
  mpq_class q(value);
  mpz_class scaled = q.get_num() << -kLowestBit;
  if (scaled % q.get_den() != 0) throw std::logic_error("oracle: a coordinate has too many bits");
  return scaled / q.get_den();
}

template <class T>
T dot3(const std::array<T, 3>& a, const std::array<T, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class T>
std::array<T, 3> minus(const std::array<T, 3>& a, const std::array<T, 3>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

template <class T>
T det3(const std::array<T, 3>& a, const std::array<T, 3>& b, const std::array<T, 3>& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

// n . s + plain >= 0 in the chart p = A + s_1 u + s_2 v + s_3 w of a tetrahedron; `c` is `plain` perturbed, in units of
// 1 / one.
struct Plane {
  Point n;
  mpz_class c, plain;
  std::int64_t label;
};

// Where three planes meet, the numerators in units of 1 / one over a positive denominator.
struct Homogeneous {
  Point numerator;
  mpz_class denominator;
};

// By Cramer's rule on n . s = -c; the constants are those that `constant` picks.
template <class Constant>
Homogeneous meet(const Plane& a, const Plane& b, const Plane& c, const Constant& constant) {
  Homogeneous v;
  v.denominator = det3(a.n, b.n, c.n);
  for (std::size_t k = 0; k < 3; ++k) {
    Point ra = a.n, rb = b.n, rc = c.n;
    ra[k] = -constant(a);
    rb[k] = -constant(b);
    rc[k] = -constant(c);
    v.numerator[k] = det3(ra, rb, rc);
  }
  if (sgn(v.denominator) < 0) {
    v.denominator = -v.denominator;
    for (mpz_class& x : v.numerator) x = -x;
  }
  return v;
}

struct Vertex {
  std::array<std::size_t, 3> planes;  // ascending positions
  bool even;                          // these are counter-clockwise seen from outside
};

// All triples of planes that meet within all others.
std::vector<Vertex> vertices_of(const std::vector<Plane>& planes) {
  std::vector<Vertex> vertices;
  const auto perturbed = [](const Plane& p) -> const mpz_class& { return p.c; };
  for (std::size_t a = 0; a < planes.size(); ++a)
    for (std::size_t b = a + 1; b < planes.size(); ++b)
      for (std::size_t c = b + 1; c < planes.size(); ++c) {
        const mpz_class determinant = det3(planes[a].n, planes[b].n, planes[c].n);
        if (determinant == 0) continue;
        const Homogeneous v = meet(planes[a], planes[b], planes[c], perturbed);
        bool inside = true;
        for (std::size_t d = 0; inside && d < planes.size(); ++d) {
          if (d == a || d == b || d == c) continue;
          const mpz_class side = dot3(planes[d].n, v.numerator) + planes[d].c * v.denominator;
          if (side == 0) throw std::logic_error("oracle: a tie survived the perturbation");
          inside = side > 0;
        }
        // The normals here point inwards.
        if (inside) vertices.push_back({{a, b, c}, determinant < 0});
      }
  return vertices;
}

// The moments of a convex polyhedron: facets fanned into triangles from one corner each, these joined to one vertex.
void add_moments(const std::vector<Vertex>& vertices, const std::vector<RationalPoint>& at, OraclePolyhedron& out) {
  std::map<std::size_t, std::vector<std::size_t>> facets;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    for (const std::size_t plane : vertices[v].planes) facets[plane].push_back(v);
  for (const auto& [plane, corners] : facets) {
    const auto neighbours = [&, plane = plane](std::size_t a, std::size_t b) {
      std::size_t common = 0;
      for (const std::size_t p : vertices[a].planes)
        for (const std::size_t q : vertices[b].planes) common += p == q;
      return a != b && common == 2;
    };
    std::vector<std::size_t> cycle{corners[0]};
    std::set<std::size_t> left(corners.begin() + 1, corners.end());
    while (!left.empty()) {
      const auto next =
          std::find_if(left.begin(), left.end(), [&](std::size_t v) { return neighbours(cycle.back(), v); });
      if (next == left.end()) throw std::logic_error("oracle: a facet's corners form no cycle");
      cycle.push_back(*next);
      left.erase(next);
    }
    for (std::size_t k = 1; k + 1 < cycle.size(); ++k) {
      const RationalPoint corner[4] = {at[0], at[cycle[0]], at[cycle[k]], at[cycle[k + 1]]};
      const mpq_class volume =
          abs(det3(minus(corner[1], corner[0]), minus(corner[2], corner[0]), minus(corner[3], corner[0]))) / 6;
      RationalPoint sum;
      mpq_class squares = 0;
      for (const RationalPoint& p : corner) {
        for (std::size_t d = 0; d < 3; ++d) sum[d] += p[d];
        squares += dot3(p, p);
      }
      out.volume += volume;
      for (std::size_t d = 0; d < 3; ++d) out.first[d] += volume * sum[d] / 4;
      out.energy += volume * (dot3(sum, sum) + squares) / 20;
    }
  }
}

}  // namespace

std::vector<OraclePolyhedron> oracle_polyhedra(const TetMesh& mesh, const std::vector<Vec3>& seeds, unsigned gap) {
  const auto integers = [](const std::vector<Vec3>& points) {
    std::vector<Point> out;
    for (const Vec3& p : points) out.push_back({exact_integer(p.x), exact_integer(p.y), exact_integer(p.z)});
    return out;
  };
  std::vector<Point> q = integers(mesh.vertices), x = integers(seeds);
  // The largest power of two that all coordinates are multiples of goes, so that grids stay small.
  unsigned low = ~0u;
  std::size_t bits = 1;
  for (const auto* points : {&q, &x})
    for (const Point& p : *points)
      for (const mpz_class& c : p)
        if (c != 0) low = std::min(low, static_cast<unsigned>(mpz_scan1(c.get_mpz_t(), 0)));
  if (low == ~0u) low = 0;
  for (auto* points : {&q, &x})
    for (Point& p : *points)
      for (mpz_class& c : p) {
        c >>= low;
        bits = std::max(bits, mpz_sizeinbase(c.get_mpz_t(), 2));
      }
  const mpq_class unit = low >= static_cast<unsigned>(-kLowestBit)
                             ? mpq_class(mpz_class(1) << (low + static_cast<unsigned>(kLowestBit)))
                             : mpq_class(1, mpz_class(1) << (static_cast<unsigned>(-kLowestBit) - low));

  // With |coordinates| < 2^m the planes' coefficients are below 2^(2m + 5), so a side test is an integer plus weights
  // times integers below 2^(6m + 21): a ratio of 2^-(6m + 24) makes the first nonzero of them decide.
  const unsigned step = (6 * static_cast<unsigned>(bits) + 24) * gap;
  const std::size_t n = x.size();
  const unsigned one_bits = step * static_cast<unsigned>(n);
  std::vector<mpz_class> weight(n);
  for (std::size_t i = 0; i < n; ++i) mpz_setbit(weight[i].get_mpz_t(), step * (n - 1 - i));

  std::vector<OraclePolyhedron> out;
  for (Index t = 0; t < mesh.tets.size(); ++t) {
    const Tetrahedron& tet = mesh.tets[t];
    const Point& origin = q[tet[0]];
    const Point edges[3] = {minus(q[tet[1]], origin), minus(q[tet[2]], origin), minus(q[tet[3]], origin)};
    const mpz_class six_volume = det3(edges[0], edges[1], edges[2]);
    if (six_volume == 0) continue;
    if (six_volume < 0) throw std::logic_error("oracle: a tetrahedron is inverted");
    for (std::size_t i = 0; i < n; ++i) {
      std::vector<Plane> planes;
      // The power of p to seed j is |p|^2 minus 2 p . x_j - |x_j|^2 + w_j.
      for (std::size_t j = 0; j < n; ++j) {
        if (j == i) continue;
        Plane plane;
        const Point d = minus(x[i], x[j]);
        for (std::size_t k = 0; k < 3; ++k) plane.n[k] = 2 * dot3(edges[k], d);
        plane.plain = 2 * dot3(origin, d) - dot3(x[i], x[i]) + dot3(x[j], x[j]);
        plane.c = (plane.plain << one_bits) + weight[i] - weight[j];
        plane.label = static_cast<std::int64_t>(j);
        planes.push_back(std::move(plane));
      }
      const mpz_class one = mpz_class(1) << one_bits;
      planes.push_back({{-1, -1, -1}, one, 1, -1});
      planes.push_back({{1, 0, 0}, 0, 0, -2});
      planes.push_back({{0, 1, 0}, 0, 0, -3});
      planes.push_back({{0, 0, 1}, 0, 0, -4});
      const std::vector<Vertex> vertices = vertices_of(planes);
      if (vertices.empty()) continue;
      OraclePolyhedron polyhedron{t, static_cast<Index>(i), {}, {}, {}, 0, 0, {}};
      std::set<std::size_t> used;
      std::vector<RationalPoint> at;
      for (const Vertex& v : vertices) {
        used.insert(v.planes.begin(), v.planes.end());
        const auto [a, b, c] = v.planes;
        if (v.even) polyhedron.vertices.push_back({planes[a].label, planes[b].label, planes[c].label});
        else polyhedron.vertices.push_back({planes[a].label, planes[c].label, planes[b].label});
        const Homogeneous plain =
            meet(planes[a], planes[b], planes[c], [](const Plane& p) -> const mpz_class& { return p.plain; });
        RationalPoint p;
        for (std::size_t d = 0; d < 3; ++d) {
          mpq_class value = origin[d] - x[i][d];
          for (std::size_t k = 0; k < 3; ++k) {
            mpq_class share(plain.numerator[k], plain.denominator);
            share.canonicalize();
            value += share * edges[k][d];
          }
          p[d] = value * unit;
        }
        at.push_back(p);
      }
      for (const std::size_t plane : used) polyhedron.labels.push_back(planes[plane].label);
      add_moments(vertices, at, polyhedron);
      polyhedron.at = std::move(at);
      out.push_back(std::move(polyhedron));
    }
  }
  return out;
}

}  // namespace bisector::test
