#include "tree/bspline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "bisector/error.h"
#include "support/models.h"

namespace bisector {
namespace {

using test::SplitMix64;

std::vector<double> random_clamped_knots(SplitMix64& random, int degree, int inner) {
  std::vector<double> knots(static_cast<std::size_t>(degree) + 1, 0.0);
  for (int i = 0; i < inner; ++i) knots.push_back(random.range(0.05, 0.95));
  std::sort(knots.begin(), knots.end());
  knots.insert(knots.end(), static_cast<std::size_t>(degree) + 1, 1.0);
  return knots;
}

BSplineCurve random_curve(SplitMix64& random, int inner) {
  BSplineCurve curve{3, random_clamped_knots(random, 3, inner), {}};
  while (curve.control.size() + 4 < curve.knots.size())
    curve.control.push_back({random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)});
  return curve;
}

double polynomial(const std::array<double, 4>& c, double t) { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); }

// Elementary symmetric polynomials of degree k of three knots, over binomials: the coefficients that t^k has (Marsden).
double blossom(const std::array<double, 4>& c, double a, double b, double d) {
  return c[0] + c[1] * (a + b + d) / 3 + c[2] * (a * b + a * d + b * d) / 3 + c[3] * a * b * d;
}

std::vector<Vec3> helix(int count, double turns, double noise, std::uint64_t seed) {
  SplitMix64 random(seed);
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) {
    const double a = 2 * M_PI * turns * i / (count - 1);
    points.push_back({std::cos(a) + random.range(-noise, noise), std::sin(a) + random.range(-noise, noise),
                      0.3 * a + random.range(-noise, noise)});
  }
  return points;
}

double distance_to_polyline(const Vec3& p, const std::vector<Vec3>& line) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Vec3 d = line[i] - line[i - 1];
    const double t = std::clamp(dot(p - line[i - 1], d) / norm2(d), 0.0, 1.0);
    best = std::min(best, norm(line[i - 1] + t * d - p));
  }
  return best;
}

TEST(BSpline, BasisIsAPartitionOfUnity) {
  SplitMix64 random(1);
  for (int degree = 1; degree <= 3; ++degree)
    for (int trial = 0; trial < 20; ++trial) {
      const std::vector<double> knots = random_clamped_knots(random, degree, trial % 6);
      for (int k = 0; k <= 40; ++k) {
        const BasisFunctions basis = basis_functions(knots, degree, k / 40.0);
        double sum = 0, slopes = 0, bends = 0;
        for (std::size_t i = 0; i < 4; ++i) {
          EXPECT_GE(basis.values[i], 0);
          sum += basis.values[i];
          slopes += basis.derivatives[i];
          bends += basis.second_derivatives[i];
        }
        EXPECT_NEAR(sum, 1, 1e-14);
        EXPECT_NEAR(slopes, 0, 1e-9);
        EXPECT_NEAR(bends, 0, 1e-5);
        EXPECT_LE(basis.first + static_cast<std::size_t>(degree) + 1,
                  knots.size() - static_cast<std::size_t>(degree) - 1);
      }
    }
}

TEST(BSpline, RepeatedInnerKnotsAreAllowed) {
  const std::vector<double> knots{0, 0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1, 1};
  const BasisFunctions at = basis_functions(knots, 3, 0.5);
  EXPECT_EQ(at.first, 3u);
  EXPECT_EQ(at.values[0], 1);
}

TEST(BSpline, CubicsAreReproduced) {
  SplitMix64 random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<double> knots = random_clamped_knots(random, 3, trial % 7);
    std::array<std::array<double, 4>, 3> c;
    for (auto& axis : c)
      for (double& value : axis) value = random.range(-1, 1);
    BSplineCurve curve{3, knots, {}};
    for (std::size_t i = 0; i + 4 < knots.size(); ++i)
      curve.control.push_back({blossom(c[0], knots[i + 1], knots[i + 2], knots[i + 3]),
                               blossom(c[1], knots[i + 1], knots[i + 2], knots[i + 3]),
                               blossom(c[2], knots[i + 1], knots[i + 2], knots[i + 3])});
    for (int k = 0; k <= 30; ++k)
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(curve.point(k / 30.0)[axis], polynomial(c[static_cast<std::size_t>(axis)], k / 30.0), 1e-14);
  }
}

TEST(BSpline, DerivativesAreThoseOfFiniteDifferences) {
  SplitMix64 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const BSplineCurve curve = random_curve(random, 4);
    for (std::size_t s = 1; s < curve.knots.size(); ++s) {
      const double span = curve.knots[s] - curve.knots[s - 1];
      if (span < 0.01) continue;
      const double t = curve.knots[s - 1] + 0.3 * span, h = 1e-4 * span;
      const Vec3 slope = (1 / (2 * h)) * (curve.point(t + h) - curve.point(t - h));
      const Vec3 bend = (1 / (2 * h)) * (curve.derivative(t + h) - curve.derivative(t - h));
      EXPECT_LT(norm(slope - curve.derivative(t)), 1e-5 * (1 + norm(slope)));
      EXPECT_LT(norm(bend - curve.second_derivative(t)), 1e-5 * (1 + norm(bend)));
    }
  }
}

TEST(BSpline, LowerDegreesToo) {
  SplitMix64 random(4);
  for (int degree = 1; degree <= 2; ++degree) {
    BSplineCurve curve{degree, random_clamped_knots(random, degree, 0), {{0, 0, 0}, {1, 2, 3}}};
    if (degree == 2) curve.control.push_back({4, 1, 0});
    const BSplineCurve cubic = as_cubic(curve);
    ASSERT_EQ(cubic.degree, 3);
    for (int k = 0; k <= 10; ++k) {
      EXPECT_LT(norm(cubic.point(k / 10.0) - curve.point(k / 10.0)), 1e-14);
      EXPECT_LT(norm(cubic.derivative(k / 10.0) - curve.derivative(k / 10.0)), 1e-13);
      EXPECT_LT(norm(cubic.second_derivative(k / 10.0) - curve.second_derivative(k / 10.0)), 1e-12);
    }
  }
}

TEST(BSpline, InsertedKnotsKeepTheCurve) {
  SplitMix64 random(5);
  for (int trial = 0; trial < 10; ++trial) {
    const BSplineCurve curve = random_curve(random, 3);
    BSplineCurve finer = curve;
    for (int k = 0; k < 5; ++k) finer = insert_knot(finer, random.range(0.01, 0.99));
    EXPECT_EQ(finer.control.size(), curve.control.size() + 5);
    EXPECT_TRUE(std::is_sorted(finer.knots.begin(), finer.knots.end()));
    for (int k = 0; k <= 50; ++k) EXPECT_LT(norm(finer.point(k / 50.0) - curve.point(k / 50.0)), 1e-13);
  }
}

TEST(BSpline, FitIsWithinTheToleranceAndKeepsTheEnds) {
  const std::vector<Vec3> points = helix(80, 1.5, 0, 1);
  std::size_t before = 0;
  for (const double tolerance : {0.5, 0.1, 0.01, 1e-3, 1e-4}) {
    const CurveFit fit = fit_curve(points, tolerance);
    EXPECT_LE(fit.max_distance, tolerance);
    EXPECT_TRUE(fit.curve.point(0) == points.front());
    EXPECT_TRUE(fit.curve.point(1) == points.back());
    ASSERT_EQ(fit.parameters.size(), points.size());
    EXPECT_TRUE(std::is_sorted(fit.parameters.begin(), fit.parameters.end()));
    EXPECT_EQ(fit.parameters.front(), 0);
    EXPECT_EQ(fit.parameters.back(), 1);
    double largest = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
      largest = std::max(largest, norm(fit.curve.point(fit.parameters[i]) - points[i]));
    EXPECT_EQ(fit.max_distance, largest);
    EXPECT_GE(fit.curve.control.size(), before);
    EXPECT_LE(fit.curve.control.size(), 30u);
    before = fit.curve.control.size();
  }
}

TEST(BSpline, NoisyPointsAreSmoothedWithinTheTolerance) {
  const double noise = 0.05;
  const std::vector<Vec3> points = helix(60, 1, noise, 7);
  const CurveFit fit = fit_curve(points, 2 * noise);
  EXPECT_LE(fit.max_distance, 2 * noise);
  // The sampled path zigzags; its fit does not.
  double path = 0, length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) path += norm(points[i] - points[i - 1]);
  for (int k = 1; k <= 1000; ++k) length += norm(fit.curve.point(k / 1000.0) - fit.curve.point((k - 1) / 1000.0));
  const double exact = 2 * M_PI * std::sqrt(1 + 0.09);
  EXPECT_NEAR(length, exact, 0.03 * exact);
  EXPECT_GT(path, 1.05 * exact);
}

TEST(BSpline, FitStaysNearPointsThatAreUnevenlySpaced) {
  SplitMix64 random(8);
  for (int trial = 0; trial < 30; ++trial) {
    std::vector<Vec3> points;
    double a = 0;
    for (int i = 0; i < 25; ++i) {
      points.push_back({3 * a, std::sin(3 * a), 0.3 * std::cos(5 * a)});
      a += std::pow(random.unit(), 4);
    }
    const CurveFit fit = fit_curve(points, 0.02);
    EXPECT_LE(fit.max_distance, 0.02);
    double gap = 0;
    for (std::size_t i = 1; i < points.size(); ++i) gap = std::max(gap, norm(points[i] - points[i - 1]));
    for (int k = 0; k <= 500; ++k)
      EXPECT_LT(distance_to_polyline(fit.curve.point(k / 500.0), points), 0.02 + 0.5 * gap);
  }
}

TEST(BSpline, CurvesWithSharpBendsComeAsNearAsTheyCan) {
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {2, 2, 0}, {2, 2, 1}, {2, 2, 2}};
  EXPECT_LE(fit_curve(points, 1e-3).max_distance, 1e-3);
  EXPECT_LE(fit_curve(points, 0, 4).max_distance, 1);
  EXPECT_EQ(fit_curve(points, 0, 4).curve.control.size(), 4u);
}

TEST(BSpline, EachPointMayHaveItsTolerance) {
  // A zigzag whose first half may be smoothed, and whose second may not.
  std::vector<Vec3> points;
  std::vector<double> tolerances;
  for (int i = 0; i < 24; ++i) {
    points.push_back({static_cast<double>(i), i % 4 == 1 ? 0.4 : i % 4 == 3 ? -0.4 : 0, 0});
    tolerances.push_back(i < 12 ? 0.5 : 0.05);
  }
  const CurveFit fit = fit_curve(points, tolerances);
  double roughest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double distance = norm(fit.curve.point(fit.parameters[i]) - points[i]);
    EXPECT_LE(distance, tolerances[i]);
    roughest = std::max(roughest, distance);
  }
  EXPECT_GT(roughest, 0.2);
  const CurveFit equal = fit_curve(points, std::vector<double>(points.size(), 0.05));
  EXPECT_LE(fit.curve.control.size(), equal.curve.control.size());
  EXPECT_LE(equal.max_distance, 0.05);
  EXPECT_THROW(fit_curve(points, std::vector<double>{0.1}), Error);
}

TEST(BSpline, StraightLinesNeedTwoControlPoints) {
  std::vector<Vec3> points;
  for (int i = 0; i < 9; ++i) points.push_back((i * i / 7.0) * Vec3{1, 2, -3});
  const CurveFit fit = fit_curve(points, 1e-9);
  EXPECT_EQ(fit.curve.control.size(), 2u);
  EXPECT_LE(fit.max_distance, 1e-12);
}

TEST(BSpline, TwoThreeAndRepeatedPoints) {
  const Vec3 a{1, 2, 3}, b{4, 2, 3}, c{4, 5, 3};
  EXPECT_EQ(fit_curve({a, b}, 0).max_distance, 0);
  EXPECT_LE(fit_curve({a, b, c}, 1e-6).max_distance, 1e-6);
  const CurveFit fit = fit_curve({a, a, b, b, b, c, c}, 1e-6);
  EXPECT_LE(fit.max_distance, 1e-6);
  ASSERT_EQ(fit.parameters.size(), 7u);
  EXPECT_EQ(fit.parameters[1], 0);
  EXPECT_EQ(fit.parameters[2], fit.parameters[4]);
  EXPECT_EQ(fit.parameters[5], 1);
}

TEST(BSpline, PathsMayReturn) {
  const Vec3 a{0, 0, 0}, b{1, 0, 0};
  for (const std::vector<Vec3>& points :
       {std::vector<Vec3>{a, b, a}, std::vector<Vec3>{a, b, {1, 1, 0}, {0, 1, 0}, a}}) {
    const CurveFit fit = fit_curve(points, 1e-3);
    EXPECT_LE(fit.max_distance, 1e-3);
    EXPECT_TRUE(fit.curve.point(1) == a);
  }
}

TEST(BSpline, FarFromTheOriginAndTiny) {
  const std::vector<Vec3> points = helix(40, 1, 0, 1);
  const CurveFit fit = fit_curve(points, 1e-3);
  std::vector<Vec3> moved = points;
  for (Vec3& p : moved) p = Vec3{3e6, -5e6, 100} + 1e-3 * p;
  const CurveFit far = fit_curve(moved, 1e-6);
  EXPECT_LE(far.max_distance, 1e-6);
  EXPECT_EQ(far.curve.control.size(), fit.curve.control.size());
}

TEST(BSpline, BadInputIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fit_curve({}, 1), Error);
  EXPECT_THROW(fit_curve({{1, 1, 1}}, 1), Error);
  EXPECT_THROW(fit_curve({{1, 1, 1}, {1, 1, 1}}, 1), Error);
  EXPECT_THROW(fit_curve({{1, 1, 1}, {nan, 1, 1}}, 1), Error);
  EXPECT_THROW(fit_curve({{0, 0, 0}, {1e200, 0, 0}}, 1), Error);
  EXPECT_THROW(fit_curve({{1, 1, 1}, {2, 1, 1}}, nan), Error);
  EXPECT_THROW(fit_curve({{1, 1, 1}, {2, 1, 1}}, -1), Error);
  EXPECT_THROW(fit_curve({{1, 1, 1}, {2, 1, 1}}, 1, 1), Error);
}

}  // namespace
}  // namespace bisector
