#include "segment/quadric.h"

#include <gtest/gtest.h>

#include "segment/quadric_fit.h"
#include "support/quadrics.h"

namespace bisector {
namespace {

using test::SplitMix64;

Vec3 random_point(SplitMix64& random, double size) {
  return size * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
}

Quadric random_quadric(SplitMix64& random) {
  Quadric q;
  for (double& c : q.c) c = random.range(-1, 1);
  return q;
}

double monomial(const Vec3& p, int i, int j, int k) { return std::pow(p.x, i) * std::pow(p.y, j) * std::pow(p.z, k); }

// Integral over a triangle by five Gauss points in each direction, of polynomials of degree eight and less exact.
template <class Function>
double integral(const Vec3& a, const Vec3& b, const Vec3& c, const Function& f) {
  const double inner = std::sqrt(5 - 2 * std::sqrt(10.0 / 7)) / 3, outer = std::sqrt(5 + 2 * std::sqrt(10.0 / 7)) / 3;
  const double x[5]{-outer, -inner, 0, inner, outer};
  const double wi = (322 + 13 * std::sqrt(70.0)) / 900, wo = (322 - 13 * std::sqrt(70.0)) / 900;
  const double w[5]{wo, wi, 128.0 / 225, wi, wo};
  double sum = 0;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) {
      const double s = (1 + x[i]) / 2, t = (1 + x[j]) / 2;
      sum += w[i] * w[j] / 4 * s * f(a + s * (b - a) + (s * t) * (c - b));
    }
  return sum * norm(cross(b - a, c - a));
}

struct Patch {
  std::vector<std::array<Vec3, 3>> triangles;

  SurfaceMoments moments(const Vec3& origin) const {
    SurfaceMoments sum;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const SurfaceMoments m = triangle_moments(triangles[t][0], triangles[t][1], triangles[t][2], origin);
      sum = t == 0 ? m : merged(sum, m);
    }
    return sum;
  }
  template <class Function>
  double sum(const Function& f) const {
    double result = 0;
    for (const auto& [a, b, c] : triangles) result += integral(a, b, c, f);
    return result;
  }
  double area() const {
    return sum([](const Vec3&) { return 1.0; });
  }
  // Taubin's first-order approximation of the squared distance, integrated (thesis appendix of chapter 2).
  double taubin(const Quadric& q) const {
    return area() * sum([&](const Vec3& p) { return value_of(q, p) * value_of(q, p); }) /
           sum([&](const Vec3& p) { return norm2(gradient_of(q, p)); });
  }
};

// Triangles between points of a surface's parametrisation.
Patch patch_of(const test::KnownSurface& s, double from, double to, int n) {
  Patch patch;
  const auto at = [&](int i, int j) {
    return s.world(s.point(from + (to - from) * i / n, from + (to - from) * j / n, 0));
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      patch.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      patch.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return patch;
}

TEST(Quadric, GradientIsTheDerivative) {
  SplitMix64 random(1);
  for (int i = 0; i < 100; ++i) {
    const Quadric q = random_quadric(random);
    const Vec3 p = random_point(random, 2), d = random_point(random, 1);
    // Central differences of second-degree polynomials are exact.
    EXPECT_NEAR(dot(gradient_of(q, p), d), value_of(q, p + 0.5 * d) - value_of(q, p - 0.5 * d), 1e-13);
  }
}

TEST(Quadric, SecondOrderBoundsTheCurvature) {
  SplitMix64 random(2);
  for (int i = 0; i < 100; ++i) {
    const Quadric q = random_quadric(random);
    const Vec3 p = random_point(random, 2), d = random_point(random, 1);
    const double bend = value_of(q, p + d) - value_of(q, p) - dot(gradient_of(q, p), d);
    EXPECT_LE(std::abs(bend), second_order_of(q) * norm2(d) + 1e-13);
  }
}

TEST(Quadric, LocalCoordinatesAreASubstitution) {
  SplitMix64 random(3);
  for (int i = 0; i < 100; ++i) {
    const Quadric q = random_quadric(random);
    const Vec3 origin = random_point(random, 5), x = random_point(random, 5);
    const double scale = random.range(0.1, 10);
    const double value = value_of(q, x), size = 1e-12 * (1 + std::abs(value)) * 1e3;
    EXPECT_NEAR(value_of(to_local(q, origin, scale), (1 / scale) * (x - origin)), value, size);
    EXPECT_NEAR(value_of(from_local(q, origin, scale), origin + scale * x), value, size);
  }
}

class EveryQuadric : public testing::TestWithParam<SurfaceType> {};

TEST_P(EveryQuadric, ApproximateDistanceIsAtMostTheExactOne) {
  SplitMix64 random(4);
  for (int i = 0; i < 10; ++i) {
    const test::KnownSurface s = test::random_surface(GetParam(), random);
    const double second_order = second_order_of(s.quadric);
    for (int j = 0; j < 20; ++j) {
      const Vec3 p = s.centre + random_point(random, 2);
      const double d = approximate_distance(s.quadric, second_order, p);
      EXPECT_GE(d, 0);
      EXPECT_LE(d, norm(test::nearest_by_search(s, p) - p) + 1e-12);
      // Of first order: near the surface the two agree.
      const Vec3 on = s.world(s.point(random.range(-1, 1), random.range(-1, 1), 0));
      const Vec3 gradient = gradient_of(s.quadric, on);
      if (norm(gradient) < 1e-2) continue;
      const Vec3 off = on + (1e-6 / norm(gradient)) * gradient;
      EXPECT_NEAR(approximate_distance(s.quadric, second_order, off), 1e-6, 1e-8);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Types, EveryQuadric,
                         testing::Values(SurfaceType::plane, SurfaceType::sphere, SurfaceType::cylinder,
                                         SurfaceType::cone, SurfaceType::ellipsoid, SurfaceType::elliptic_paraboloid,
                                         SurfaceType::hyperbolic_paraboloid, SurfaceType::one_sheet_hyperboloid,
                                         SurfaceType::two_sheet_hyperboloid, SurfaceType::elliptic_cone,
                                         SurfaceType::elliptic_cylinder, SurfaceType::hyperbolic_cylinder,
                                         SurfaceType::parabolic_cylinder, SurfaceType::plane_pair),
                         [](const auto& test) { return std::string(name_of(test.param)); });

TEST(Moments, AreTheIntegrals) {
  SplitMix64 random(5);
  for (int i = 0; i < 50; ++i) {
    const Vec3 a = random_point(random, 1), b = random_point(random, 1), c = random_point(random, 1);
    const Vec3 origin = random_point(random, i % 2 == 0 ? 0 : 2);
    const SurfaceMoments m = triangle_moments(a, b, c, origin);
    for (int x = 0; x <= 4; ++x)
      for (int y = 0; x + y <= 4; ++y)
        for (int z = 0; x + y + z <= 4; ++z)
          EXPECT_NEAR(m.m[monomial_index(x, y, z)],
                      integral(a, b, c, [&](const Vec3& p) { return monomial(p - origin, x, y, z); }), 1e-12);
  }
}

TEST(Moments, EveryMonomialHasItsPlace) {
  std::vector<char> taken(SurfaceMoments::kCount);
  for (int x = 0; x <= 4; ++x)
    for (int y = 0; x + y <= 4; ++y)
      for (int z = 0; x + y + z <= 4; ++z) {
        ASSERT_LT(monomial_index(x, y, z), SurfaceMoments::kCount);
        EXPECT_FALSE(taken[monomial_index(x, y, z)]++);
      }
}

TEST(Moments, MoveAndMergeAsIntegralsDo) {
  SplitMix64 random(6);
  for (int i = 0; i < 20; ++i) {
    Vec3 p[6];
    for (Vec3& x : p) x = random_point(random, 1);
    const Vec3 from = random_point(random, 1), to = random_point(random, 1);
    const SurfaceMoments a = triangle_moments(p[0], p[1], p[2], from), b = triangle_moments(p[3], p[4], p[5], to);
    const SurfaceMoments there = moved(a, to), direct = triangle_moments(p[0], p[1], p[2], to), both = merged(a, b);
    const Vec3 centroid = (1 / (a.area() + b.area())) * (a.area() * a.centroid() + b.area() * b.centroid());
    EXPECT_LT(norm(both.origin - centroid), 1e-14);
    EXPECT_LT(norm(both.centroid() - centroid), 1e-14);
    const SurfaceMoments first = triangle_moments(p[0], p[1], p[2], both.origin);
    const SurfaceMoments second = triangle_moments(p[3], p[4], p[5], both.origin);
    for (std::size_t k = 0; k < SurfaceMoments::kCount; ++k) {
      EXPECT_NEAR(there.m[k], direct.m[k], 1e-12);
      EXPECT_NEAR(both.m[k], first.m[k] + second.m[k], 1e-12);
    }
  }
}

TEST(Moments, OfNothingAreHarmless) {
  const Vec3 p{1, 2, 3};
  const SurfaceMoments none = triangle_moments(p, p, p, {});
  EXPECT_EQ(none.area(), 0);
  const SurfaceMoments some = triangle_moments({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {});
  EXPECT_NEAR(merged(none, some).area(), 0.5, 1e-15);
  EXPECT_NEAR(merged(some, none).area(), 0.5, 1e-15);
  EXPECT_EQ(merged(none, none).area(), 0);
  EXPECT_FALSE(fit_quadric(none).valid);
  EXPECT_EQ(fit_plane(none).squared_distance, 0);
}

TEST(PlaneFit, FindsPlanes) {
  SplitMix64 random(7);
  for (const double away : {0.0, 1e4})
    for (int i = 0; i < 20; ++i) {
      const test::KnownSurface s = test::random_surface(SurfaceType::plane, random, 1, away);
      const Patch patch = patch_of(s, -0.5, 0.7, 3);
      const PlaneFit fit = fit_plane(patch.moments(s.centre));
      EXPECT_NEAR(std::abs(dot(fit.normal, s.axes[2])), 1, 1e-12);
      EXPECT_NEAR(dot(fit.normal, s.centre), fit.offset, 1e-12 * (1 + away));
      EXPECT_LT(fit.squared_distance, 1e-13);
    }
}

TEST(PlaneFit, NoOtherPlaneIsNearer) {
  SplitMix64 random(8);
  for (int i = 0; i < 20; ++i) {
    const Patch patch = patch_of(test::random_surface(SurfaceType::ellipsoid, random), -0.4, 0.9, 4);
    const PlaneFit fit = fit_plane(patch.moments({}));
    const auto squared = [&](const Vec3& n, double offset) {
      return patch.sum([&](const Vec3& p) { return (dot(n, p) - offset) * (dot(n, p) - offset); });
    };
    EXPECT_NEAR(fit.squared_distance, squared(fit.normal, fit.offset), 1e-12);
    for (int j = 0; j < 20; ++j) {
      Vec3 n = fit.normal + random_point(random, 0.01);
      n *= 1 / norm(n);
      EXPECT_GE(squared(n, fit.offset + random.range(-0.01, 0.01)), fit.squared_distance - 1e-13);
    }
  }
}

TEST(QuadricFit, IsTaubinsMinimum) {
  SplitMix64 random(9);
  for (const SurfaceType type : {SurfaceType::ellipsoid, SurfaceType::one_sheet_hyperboloid, SurfaceType::torus})
    for (int i = 0; i < 5; ++i) {
      const Patch patch = patch_of(test::random_surface(type, random), -0.6, 0.9, 5);
      const QuadricFit fit = fit_quadric(patch.moments(patch.triangles[0][0]));
      ASSERT_TRUE(fit.valid);
      const double least = patch.taubin(fit.quadric);
      EXPECT_NEAR(fit.squared_distance, least, 1e-9 * least + 1e-14);
      double size = 0;
      for (double c : fit.quadric.c) size = std::max(size, std::abs(c));
      for (int j = 0; j < 30; ++j) {
        Quadric other = fit.quadric;
        for (double& c : other.c) c += size * std::pow(10, -1 - j % 4) * random.range(-1, 1);
        EXPECT_GE(patch.taubin(other), least * (1 - 1e-9));
      }
    }
}

TEST(QuadricFit, FindsThePlanesThatTrianglesLieOn) {
  SplitMix64 random(10);
  for (int i = 0; i < 10; ++i) {
    const test::KnownSurface s = test::random_surface(SurfaceType::plane_pair, random);
    Patch patch;
    for (int sheet = 0; sheet < 2; ++sheet)
      for (int j = 0; j < 4; ++j) {
        const auto corner = [&] { return s.world(s.point(random.range(-1, 1), random.range(-1, 1), sheet)); };
        patch.triangles.push_back({corner(), corner(), corner()});
      }
    const QuadricFit fit = fit_quadric(patch.moments({}));
    ASSERT_TRUE(fit.valid);
    EXPECT_LT(fit.squared_distance, 1e-12);
    const double second_order = second_order_of(fit.quadric);
    for (int j = 0; j < 20; ++j) {
      const Vec3 p = s.world(s.point(random.range(-1, 1), random.range(-1, 1), j % 2));
      EXPECT_LT(approximate_distance(fit.quadric, second_order, p), 1e-6);
    }
  }
}

// The triangles' distance to the surface falls with the square of their size, and so does the fit's.
TEST(QuadricFit, TendsToTheSurface) {
  SplitMix64 random(11);
  for (const double away : {0.0, 1e4}) {
    const test::KnownSurface s = test::random_surface(SurfaceType::ellipsoid, random, 1, away);
    double last = 0;
    for (const int n : {8, 16, 32}) {
      const QuadricFit fit = fit_quadric(patch_of(s, -0.5, 1, n).moments(s.centre));
      ASSERT_TRUE(fit.valid);
      const Quadric local = to_local(fit.quadric, s.centre, 1);
      const double second_order = second_order_of(local);
      double worst = 0;
      for (int j = 0; j < 50; ++j) {
        const Vec3 p = s.world(s.point(-0.5 + 1.5 * random.unit(), -0.5 + 1.5 * random.unit(), 0)) - s.centre;
        worst = std::max(worst, approximate_distance(local, second_order, p));
      }
      if (last > 0) {
        EXPECT_LT(worst, last / 2.5);
      }
      last = worst;
    }
    EXPECT_LT(last, 2e-3);
  }
}

TEST(QuadricFit, OfAPlaneIsThePlaneOrNone) {
  SplitMix64 random(12);
  for (int i = 0; i < 20; ++i) {
    const test::KnownSurface s = test::random_surface(SurfaceType::plane, random);
    Patch patch = patch_of(s, -0.5, 0.7, i % 2 == 0 ? 1 : 4);
    if (i % 2 == 0) patch.triangles.resize(1);
    const QuadricFit fit = fit_quadric(patch.moments({}));
    EXPECT_LT(fit.squared_distance, 1e-12);
    if (!fit.valid) continue;
    for (const auto& [a, b, c] : patch.triangles)
      EXPECT_LT(approximate_distance(fit.quadric, second_order_of(fit.quadric), (1.0 / 3) * (a + b + c)), 1e-6);
  }
}

}  // namespace
}  // namespace bisector
