// The tetrahedron clipper's error bounds and moments against exact arithmetic.
#include "voronoi/clip_tet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/models.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

Vec3 random_point(SplitMix64& random) { return {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)}; }

struct Problem {
  std::array<Vec3, 4> corners;
  std::vector<Vec3> seeds;
};

enum class Shape { random, needle, sliver, cap };
enum class Seeding { random, cospherical, cocircular, grid, in_a_facet, aligned, clustered };

constexpr Shape kShapes[] = {Shape::random, Shape::needle, Shape::sliver, Shape::cap};
constexpr Seeding kSeedings[] = {Seeding::random,     Seeding::cospherical, Seeding::cocircular, Seeding::grid,
                                 Seeding::in_a_facet, Seeding::aligned,     Seeding::clustered};

// A tetrahedron of size about 1, `thin` where its shape is, and seeds that miss their special position by `jitter`.
Problem make_problem(SplitMix64& random, Shape shape, Seeding seeding, double thin, double jitter) {
  Problem p;
  const Vec3 a = 0.1 * random_point(random), u = random_point(random), v = random_point(random),
             w = random_point(random);
  switch (shape) {
    case Shape::random: p.corners = {a, a + u, a + v, a + w}; break;
    case Shape::needle: p.corners = {a, a + thin * u, a + thin * v, a + w}; break;
    case Shape::sliver: p.corners = {a, a + u, a + v, a + 0.6 * u + 0.7 * v + thin * w}; break;
    case Shape::cap: p.corners = {a, a + u, a + v, a + 0.3 * u + 0.3 * v + thin * w}; break;
  }
  if (dot(p.corners[1] - a, cross(p.corners[2] - a, p.corners[3] - a)) < 0) std::swap(p.corners[2], p.corners[3]);
  const Vec3 centre = 0.25 * (p.corners[0] + p.corners[1] + p.corners[2] + p.corners[3]);
  const std::size_t count = 4 + random.below(20);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 noise = jitter * random_point(random);
    const double r = random.unit(), s = random.unit();
    Vec3 x;
    switch (seeding) {
      case Seeding::random: x = centre + 0.5 * random_point(random); break;
      case Seeding::cospherical: {
        const Vec3 d = random_point(random);
        x = centre + (0.4 / (norm(d) + 1e-3)) * d + noise;
        break;
      }
      case Seeding::cocircular: x = centre + 0.4 * Vec3{std::cos(6.3 * r), std::sin(6.3 * r), 0} + noise; break;
      case Seeding::grid:
        x = centre +
            0.25 * Vec3{static_cast<double>(i % 3) - 1, static_cast<double>(i / 3 % 3) - 1,
                        static_cast<double>(i / 9) - 1} +
            noise;
        break;
      case Seeding::in_a_facet: x = a + r * (p.corners[1] - a) + s * (p.corners[2] - a) + noise; break;
      case Seeding::aligned: x = centre + (r - 0.5) * u + noise; break;
      case Seeding::clustered: x = centre + 1e-4 * random_point(random) + noise; break;
    }
    p.seeds.push_back(x);
  }
  return p;
}

ExactPlane exact_plane(const SortedSeeds& seeds, Index label) {
  if (is_facet(label)) return ExactPlane::tet_facet(static_cast<int>(label & ~kFacetLabel));
  return ExactPlane::bisector(seeds.x[label], seeds.id[label]);
}

template <class Visit>
void each_clip(const Problem& p, const Visit& visit) {
  const SortedSeeds seeds = sort_seeds(p.seeds);
  Neighbours neighbours;
  neighbours.build(seeds, NeighbourSource::nearest);
  const double six_volume = exact_six_volume(p.corners[0], p.corners[1], p.corners[2], p.corners[3]);
  if (!(six_volume > 0)) return;
  const TetFrame tet(p.corners, {0, 1, 2, 3}, nullptr, six_volume);
  TetClipper clipper;
  clipper.reset(seeds, neighbours);
  for (Index s = 0; s < seeds.x.size(); ++s) {
    clipper.begin(s);
    if (clipper.clip(tet)) visit(seeds, s, clipper, six_volume);
  }
}

TEST(ClipTet, SlackBoundsTheErrorOfEveryVertex) {
  SplitMix64 random(1);
  double worst = 0;
  std::size_t vertices = 0;
  for (int k = 0; k < 1200; ++k) {
    const Shape shape = kShapes[random.below(std::size(kShapes))];
    const Seeding seeding = kSeedings[random.below(std::size(kSeedings))];
    const double thin = std::pow(10.0, -random.range(0, 9)), jitter = std::pow(10.0, -random.range(1, 17));
    const Problem p = make_problem(random, shape, seeding, thin, jitter);
    each_clip(p, [&](const SortedSeeds& seeds, Index s, TetClipper& clipper, double) {
      const ExactTetFrame frame{{p.corners[0], p.corners[1], p.corners[2], p.corners[3]}, seeds.x[s], seeds.id[s]};
      const std::vector<Index> labels = clipper.labels();
      for (std::size_t v = 0; v < clipper.vertex_count(); ++v) {
        const std::array<Index, 3> on = clipper.triple(v);
        const Vec3 exact = exact_vertex(frame, exact_plane(seeds, labels[on[0]]), exact_plane(seeds, labels[on[1]]),
                                        exact_plane(seeds, labels[on[2]]));
        const Vec3 error = clipper.vertex(v) - exact;
        const double most = std::max({std::abs(error.x), std::abs(error.y), std::abs(error.z)});
        ASSERT_LE(most, clipper.slack(v))
            << "shape " << int(shape) << ", seeds " << int(seeding) << ", thin " << thin << ", jitter " << jitter;
        worst = std::max(worst, most / clipper.slack(v));
        ++vertices;
      }
    });
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(vertices, 10000u);
  EXPECT_GT(worst, 1e-4);  // else the bound would say nothing
}

TEST(ClipTet, PiecesAddUpToTheTetrahedron) {
  SplitMix64 random(2);
  for (int k = 0; k < 600; ++k) {
    const Shape shape = kShapes[random.below(std::size(kShapes))];
    const Problem p = make_problem(random, shape, kSeedings[random.below(std::size(kSeedings))],
                                   std::pow(10.0, -random.range(0, 8)), std::pow(10.0, -random.range(1, 17)));
    const Vec3 origin = p.corners[0];
    Moments sum;
    double six = 0;
    each_clip(p, [&](const SortedSeeds& seeds, Index s, TetClipper& clipper, double six_volume) {
      six = six_volume;
      sum += moved(clipper.integrate<true>(), seeds.x[s] - origin);
    });
    if (six == 0) continue;
    const Vec3 a = p.corners[1] - origin, b = p.corners[2] - origin, c = p.corners[3] - origin;
    const Moments want = scaled_terms<true>(tet_terms(a, b, c, six));
    // The determinants are off by rounding of products of three edges, however small they are.
    const double edge = std::max({norm(a), norm(b), norm(c), norm(b - a), norm(c - a), norm(c - b)});
    const double bound = 1e-14 * edge * edge * edge;
    EXPECT_NEAR(sum.mass, want.mass, bound);
    EXPECT_LE(norm(sum.first - want.first), 4 * edge * bound);
    EXPECT_NEAR(sum.second, want.second, 16 * edge * edge * bound);
  }
}

// A quadrature of degree 3 on a tetrahedron: the corners and the centres of the facets, exact for the products of a
// linear density and a square.
Moments by_quadrature(const Vec3 (&q)[4], const double (&rho)[4], double volume) {
  Moments sum;
  const auto add = [&](const Vec3& p, double r, double weight) {
    sum += {weight * r, (weight * r) * p, weight * r * norm2(p)};
  };
  for (int k = 0; k < 4; ++k) {
    add(q[k], rho[k], volume / 40);
    Vec3 centre;
    double r = 0;
    for (int m = 0; m < 4; ++m)
      if (m != k) {
        centre += (1.0 / 3) * q[m];
        r += rho[m] / 3;
      }
    add(centre, r, volume * 9 / 40);
  }
  return sum;
}

TEST(ClipTet, TermsAreThoseOfQuadrature) {
  SplitMix64 random(3);
  for (int k = 0; k < 100; ++k) {
    const Vec3 a = random_point(random), b = random_point(random), c = random_point(random);
    const double r[4] = {random.range(1, 2), random.range(1, 2), random.range(1, 2), random.range(1, 2)};
    const double six = dot(a, cross(b, c));
    const Vec3 q[4] = {{}, a, b, c};
    const Moments got = scaled_terms<false>(tet_terms(a, b, c, r[0], r[1], r[2], r[3], six));
    const Moments want = by_quadrature(q, r, six / 6);
    EXPECT_NEAR(got.mass, want.mass, 1e-14);
    EXPECT_LE(norm(got.first - want.first), 1e-14);
    EXPECT_NEAR(got.second, want.second, 1e-14);
    const Moments uniform = scaled_terms<true>(tet_terms(a, b, c, six));
    const Moments ones = by_quadrature(q, {1, 1, 1, 1}, six / 6);
    EXPECT_NEAR(uniform.mass, ones.mass, 1e-14);
    EXPECT_LE(norm(uniform.first - ones.first), 1e-14);
    EXPECT_NEAR(uniform.second, ones.second, 1e-14);
  }
}

TEST(ExactTet, SixVolumeHasTheSignOfTheExactOne) {
  const double tiny = 0x1p-52;
  EXPECT_EQ(exact_six_volume({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), 1);
  EXPECT_EQ(exact_six_volume({0.1, 0.1, 0.1}, {0.2, 0.2, 0.2}, {0.7, 0.1, 0.3}, {0.4, 0.4, 0.4}), 0);
  EXPECT_GT(exact_six_volume({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0.5, tiny}), 0);
  EXPECT_LT(exact_six_volume({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0.5, -tiny}), 0);
  EXPECT_GT(exact_six_volume({0, 0, 0}, {1e-120, 0, 0}, {0, 1e-120, 0}, {0, 0, 1e-120}), 0);
}

// A vertex of a facet and two bisectors is decided alike from both tetrahedra at the facet, also where all is a tie.
TEST(ExactTet, AFacetDecidesAlikeFromBothSides) {
  SplitMix64 random(4);
  const auto lattice = [&] { return Vec3{double(random.below(3)), double(random.below(3)), double(random.below(3))}; };
  std::size_t compared = 0;
  for (int k = 0; k < 4000; ++k) {
    Vec3 q[5], x[4];
    for (Vec3& p : q) p = lattice();
    for (Vec3& p : x) p = lattice();
    // Facet 3 of (0, 1, 2, 3) is facet 3 of (0, 2, 1, 4).
    if (!(exact_six_volume(q[0], q[1], q[2], q[3]) > 0) || !(exact_six_volume(q[0], q[2], q[1], q[4]) > 0)) continue;
    const ExactTetFrame above{{q[0], q[1], q[2], q[3]}, x[0], 7}, below{{q[0], q[2], q[1], q[4]}, x[0], 7};
    const Vec3 n = cross(q[1] - q[0], q[2] - q[0]), d1 = x[1] - x[0], d2 = x[2] - x[0];
    // The outward normal of facet 3 is -n above and n below.
    const double turn = dot(n, cross(d1, d2));
    if (turn == 0) continue;
    const ExactPlane f = ExactPlane::tet_facet(3), a = ExactPlane::bisector(x[1], 5), b = ExactPlane::bisector(x[2], 9),
                     c = ExactPlane::bisector(x[3], 6);
    const int from_above = turn < 0 ? exact_side(above, f, a, b, c) : exact_side(above, f, b, a, c);
    const int from_below = turn > 0 ? exact_side(below, f, a, b, c) : exact_side(below, f, b, a, c);
    EXPECT_EQ(from_above, from_below);
    ++compared;
  }
  EXPECT_GT(compared, 100u);
}

}  // namespace
}  // namespace bisector::test
