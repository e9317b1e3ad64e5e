#include "support/oracle.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace bisector::test {
namespace {

using Point = std::array<mpz_class, 3>;
using RationalPoint = std::array<mpq_class, 3>;

mpz_class dot3(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
mpq_class dot3(const RationalPoint& a, const RationalPoint& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

// All coordinates times 2^shift are integers of at most `bits` bits.
struct Scale {
  int shift = 0;
  int bits = 1;
};

Scale common_scale(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  int lowest = 0, highest = 1;
  for (const std::vector<Vec3>* points : {&a, &b})
    for (const Vec3& p : *points)
      for (int k = 0; k < 3; ++k) {
        if (p[k] == 0) continue;
        int exponent;
        auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(p[k], &exponent), 53));
        highest = std::max(highest, exponent);
        int low = exponent - 53;
        for (; mantissa % 2 == 0; mantissa /= 2) ++low;
        lowest = std::min(lowest, low);
      }
  return {-lowest, highest - lowest};
}

std::vector<Point> scaled(const std::vector<Vec3>& points, const Scale& scale) {
  std::vector<Point> out(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      int exponent;
      const double mantissa = std::ldexp(std::frexp(points[i][k], &exponent), 53);
      const int up = exponent - 53 + scale.shift;
      mpz_class z(mantissa);
      if (up >= 0) mpz_mul_2exp(z.get_mpz_t(), z.get_mpz_t(), static_cast<unsigned>(up));
      else mpz_tdiv_q_2exp(z.get_mpz_t(), z.get_mpz_t(), static_cast<unsigned>(-up));
      out[i][static_cast<std::size_t>(k)] = z;
    }
  return out;
}

// a s + b t + c >= 0 in the chart p = A + s (B - A) + t (C - A) of a triangle; c is perturbed and in units of 1 / one.
struct Line {
  mpz_class a, b, c;
  mpz_class plain;  // c without perturbation, in units of 1
  std::int64_t label;
};

// Where an edge meets the next one: (x / (d one), y / (d one)), d > 0.
struct Corner {
  mpz_class x, y, d;
};

Corner meet(const Line& p, const Line& q) {
  Corner v{p.b * q.c - q.b * p.c, p.c * q.a - q.c * p.a, p.a * q.b - q.a * p.b};
  if (sgn(v.d) <= 0) throw std::logic_error("oracle: consecutive edges do not turn left");
  return v;
}

// A convex polygon as the cycle of its edges, counter-clockwise; corner k is where edge k meets edge k + 1.
struct Polygon {
  std::vector<Line> edges;
  std::vector<Corner> corners;

  void clip(const Line& line) {
    const std::size_t n = edges.size();
    std::vector<bool> inside(n);
    std::size_t count = 0;
    mpz_class side;
    for (std::size_t k = 0; k < n; ++k) {
      side = line.a * corners[k].x;
      side += line.b * corners[k].y;
      side += line.c * corners[k].d;
      if (sgn(side) == 0) throw std::logic_error("oracle: a tie survived the perturbation");
      inside[k] = sgn(side) > 0;
      count += inside[k];
    }
    if (count == n) return;
    if (count == 0) {
      edges.clear();
      corners.clear();
      return;
    }
    std::size_t first = 0;  // the first corner inside after one outside
    while (!(inside[first] && !inside[(first + n - 1) % n])) ++first;
    std::vector<Line> kept;
    for (std::size_t k = 0; k <= count; ++k) kept.push_back(edges[(first + k) % n]);
    kept.push_back(line);
    std::vector<Corner> met;
    for (std::size_t k = 0; k < count; ++k) met.push_back(corners[(first + k) % n]);
    met.push_back(meet(kept[count], line));
    met.push_back(meet(line, kept[0]));
    edges = std::move(kept);
    corners = std::move(met);
  }
};

// The problem in integers, with weights w_r = 2^(-step (r + 1)).
class Oracle {
 public:
  Oracle(const TriangleMesh& mesh, const std::vector<Vec3>& seeds, const OracleOptions& options)
      : mesh_(mesh), scale_(common_scale(mesh.vertices, seeds)), vertices_(scaled(mesh.vertices, scale_)),
        seeds_(scaled(seeds, scale_)) {
    // With |coordinates| < 2^m: |a|, |b|, |plain| < 2^(2m + 5), so a side test is an integer plus weights times
    // integers below 3 * 2^(4m + 11); a ratio of 2^-(4m + 14) makes the first non-zero of them decide.
    const unsigned step = (4 * static_cast<unsigned>(scale_.bits) + 14) * options.gap;
    const std::size_t n = seeds.size();
    unit_bits_ = step * static_cast<unsigned>(n);
    weights_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t rank = options.rank.empty() ? i : options.rank[i];
      mpz_setbit(weights_[i].get_mpz_t(), step * (n - 1 - rank));
    }
  }

  const Scale& scale() const { return scale_; }

  // Calls visit(triangle, seed, A, u, v, polygon) for every non-empty polygon.
  template <class Visit>
  void each_polygon(const Visit& visit) const {
    const std::size_t n = seeds_.size();
    std::vector<mpz_class> a(n), b(n), plain(n), c(n);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const Triangle& triangle = mesh_.triangles[t];
      const Point& origin = vertices_[triangle[0]];
      const Point u = minus(vertices_[triangle[1]], origin), v = minus(vertices_[triangle[2]], origin);
      if (u[0] * v[1] == u[1] * v[0] && u[1] * v[2] == u[2] * v[1] && u[2] * v[0] == u[0] * v[2]) continue;
      // The power of p to seed i is |p|^2 minus this affine function.
      for (std::size_t i = 0; i < n; ++i) {
        a[i] = 2 * dot3(u, seeds_[i]);
        b[i] = 2 * dot3(v, seeds_[i]);
        plain[i] = 2 * dot3(origin, seeds_[i]) - dot3(seeds_[i], seeds_[i]);
        c[i] = (plain[i] << unit_bits_) + weights_[i];
      }
      for (std::size_t i = 0; i < n; ++i) {
        Polygon polygon = whole_triangle();
        for (std::size_t j = 0; j < n && !polygon.edges.empty(); ++j)
          if (j != i)
            polygon.clip({a[i] - a[j], b[i] - b[j], c[i] - c[j], plain[i] - plain[j], static_cast<std::int64_t>(j)});
        if (!polygon.edges.empty()) visit(static_cast<Index>(t), static_cast<Index>(i), origin, u, v, polygon);
      }
    }
  }

  const Point& seed(Index i) const { return seeds_[i]; }

 private:
  Polygon whole_triangle() const {
    const mpz_class one = mpz_class(1) << unit_bits_;
    Polygon p;
    p.edges = {{0, 1, 0, 0, -1}, {-1, -1, one, 1, -2}, {1, 0, 0, 0, -3}};
    for (std::size_t k = 0; k < 3; ++k) p.corners.push_back(meet(p.edges[k], p.edges[(k + 1) % 3]));
    return p;
  }

  const TriangleMesh& mesh_;
  Scale scale_;
  std::vector<Point> vertices_, seeds_;
  std::vector<mpz_class> weights_;
  unsigned unit_bits_ = 0;
};

// Corners without perturbation, in the triangle's chart.
std::vector<std::array<mpq_class, 2>> plain_corners(const Polygon& polygon) {
  std::vector<std::array<mpq_class, 2>> out;
  const std::size_t n = polygon.edges.size();
  for (std::size_t k = 0; k < n; ++k) {
    const Line &p = polygon.edges[k], &q = polygon.edges[(k + 1) % n];
    const mpz_class& d = polygon.corners[k].d;
    mpq_class s(p.b * q.plain - q.b * p.plain, d), t(p.plain * q.a - q.plain * p.a, d);
    s.canonicalize();
    t.canonicalize();
    out.push_back({s, t});
  }
  return out;
}

// Area over the triangle's, of corners 0, k and k + 1.
mpq_class fan_share(const std::vector<std::array<mpq_class, 2>>& st, std::size_t k) {
  return (st[k][0] - st[0][0]) * (st[k + 1][1] - st[0][1]) - (st[k][1] - st[0][1]) * (st[k + 1][0] - st[0][0]);
}

constexpr unsigned kSumBits = 320;

struct Moments {
  mpf_class mass{0, kSumBits}, energy{0, kSumBits};
  std::array<mpf_class, 3> first{mpf_class(0, kSumBits), mpf_class(0, kSumBits), mpf_class(0, kSumBits)};
};

double rescaled(mpf_class value, int shift) {
  if (shift >= 0) mpf_div_2exp(value.get_mpf_t(), value.get_mpf_t(), static_cast<unsigned>(shift));
  else mpf_mul_2exp(value.get_mpf_t(), value.get_mpf_t(), static_cast<unsigned>(-shift));
  return value.get_d();
}

// Adds the moments of a polygon about the seed x; u and v span its triangle from the corner `origin`.
void add_moments(const Polygon& polygon, const Point& x, const Point& origin, const Point& u, const Point& v,
                 Moments& sum) {
  const std::vector<std::array<mpq_class, 2>> st = plain_corners(polygon);
  std::vector<RationalPoint> q(st.size());
  for (std::size_t k = 0; k < st.size(); ++k)
    for (std::size_t d = 0; d < 3; ++d) q[k][d] = (origin[d] - x[d]) + st[k][0] * u[d] + st[k][1] * v[d];
  mpq_class mass = 0, energy = 0;
  RationalPoint first;
  for (std::size_t k = 1; k + 1 < st.size(); ++k) {
    const mpq_class share = fan_share(st, k);
    const RationalPoint &p = q[0], &r = q[k], &s = q[k + 1];
    mass += share;
    for (std::size_t d = 0; d < 3; ++d) first[d] += share * (p[d] + r[d] + s[d]) / 3;
    energy += share * (dot3(p, p) + dot3(r, r) + dot3(s, s) + dot3(p, r) + dot3(r, s) + dot3(s, p)) / 6;
  }
  const mpz_class normal2 = dot3(u, u) * dot3(v, v) - dot3(u, v) * dot3(u, v);
  const mpf_class area = sqrt(mpf_class(normal2, kSumBits)) / 2;
  sum.mass += area * mpf_class(mass, kSumBits);
  sum.energy += area * mpf_class(energy, kSumBits);
  for (std::size_t d = 0; d < 3; ++d) sum.first[d] += area * mpf_class(first[d], kSumBits);
}

}  // namespace

std::vector<OraclePolygon> oracle_polygons(const TriangleMesh& mesh, const std::vector<Vec3>& seeds,
                                           const OracleOptions& options) {
  const Oracle oracle(mesh, seeds, options);
  std::vector<OraclePolygon> out;
  oracle.each_polygon([&](Index t, Index i, const Point&, const Point&, const Point&, const Polygon& polygon) {
    OraclePolygon p{t, i, {}, 0};
    for (const Line& edge : polygon.edges) p.edges.push_back(edge.label);
    const std::vector<std::array<mpq_class, 2>> st = plain_corners(polygon);
    for (std::size_t k = 1; k + 1 < st.size(); ++k) p.share += fan_share(st, k);
    out.push_back(std::move(p));
  });
  return out;
}

OracleDiagram oracle_diagram(const TriangleMesh& mesh, const std::vector<Vec3>& seeds, const OracleOptions& options) {
  const Oracle oracle(mesh, seeds, options);
  OracleDiagram out;
  std::vector<Moments> sums(seeds.size());
  oracle.each_polygon(
      [&](Index t, Index i, const Point& origin, const Point& u, const Point& v, const Polygon& polygon) {
        out.pairs.push_back({t, i});
        const std::size_t n = polygon.edges.size();
        for (std::size_t k = 0; k < n; ++k) {
          const std::int64_t j = polygon.edges[k].label, l = polygon.edges[(k + 1) % n].label;
          if (j < 0 || l < 0) continue;
          Triangle triple{i, static_cast<Index>(j), static_cast<Index>(l)};
          std::sort(triple.begin(), triple.end());
          out.rdt.push_back(triple);
        }
        add_moments(polygon, oracle.seed(i), origin, u, v, sums[i]);
      });
  std::sort(out.rdt.begin(), out.rdt.end());
  out.rdt.erase(std::unique(out.rdt.begin(), out.rdt.end()), out.rdt.end());
  const int shift = oracle.scale().shift;
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const Moments& m = sums[i];
    out.mass.push_back(rescaled(m.mass, 2 * shift));
    out.energy.push_back(rescaled(m.energy, 4 * shift));
    Vec3 c;
    if (sgn(m.mass) > 0)
      for (int d = 0; d < 3; ++d) {
        const auto k = static_cast<std::size_t>(d);
        const mpf_class x(oracle.seed(static_cast<Index>(i))[k], kSumBits);
        c[d] = rescaled(x + m.first[k] / m.mass, shift);
      }
    out.centroid.push_back(c);
  }
  return out;
}

}  // namespace bisector::test
