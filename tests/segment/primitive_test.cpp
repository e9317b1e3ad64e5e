#include "segment/primitive.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <optional>
#include <set>

#include "bisector/error.h"
#include "segment/primitive_fit.h"
#include "support/primitive_parameters.h"
#include "support/quadrics.h"

namespace bisector {
namespace {

using test::KnownSurface;
using test::parameters_of;
using test::PrimitiveParameters;
using test::SplitMix64;

constexpr double kPi = std::numbers::pi;
constexpr SurfaceType kRound[]{SurfaceType::plane, SurfaceType::sphere, SurfaceType::cylinder, SurfaceType::cone,
                               SurfaceType::torus};
constexpr SurfaceType kQuadrics[]{SurfaceType::plane,
                                  SurfaceType::sphere,
                                  SurfaceType::cylinder,
                                  SurfaceType::cone,
                                  SurfaceType::ellipsoid,
                                  SurfaceType::elliptic_paraboloid,
                                  SurfaceType::hyperbolic_paraboloid,
                                  SurfaceType::one_sheet_hyperboloid,
                                  SurfaceType::two_sheet_hyperboloid,
                                  SurfaceType::elliptic_cone,
                                  SurfaceType::elliptic_cylinder,
                                  SurfaceType::hyperbolic_cylinder,
                                  SurfaceType::parabolic_cylinder,
                                  SurfaceType::plane_pair};

Vec3 random_point(SplitMix64& random, double size) {
  return size * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
}

// Of unit variance.
double gaussian(SplitMix64& random) {
  return std::sqrt(-2 * std::log(1 - random.unit())) * std::cos(2 * kPi * random.unit());
}

// The primitive itself where it can be made from parameters, else by classification.
Primitive primitive_of(const KnownSurface& s) {
  switch (s.type) {
    case SurfaceType::plane: return make_plane(3.0 * s.axes[2], 3.0 * dot(s.axes[2], s.centre));
    case SurfaceType::sphere: return make_sphere(s.centre, s.lengths[0]);
    case SurfaceType::cylinder: return make_cylinder(s.centre, 2.0 * s.axes[2], s.lengths[0]);
    case SurfaceType::cone: return make_cone(s.centre, 2.0 * s.axes[2], s.lengths[0]);
    case SurfaceType::torus: return make_torus(s.centre, 2.0 * s.axes[2], s.lengths[0], s.lengths[1]);
    default: return classify(s.quadric, s.centre, 2 * s.scale, 0);
  }
}

// A plane, sphere, cylinder, cone or torus.
Primitive primitive_of(SurfaceType type, const Vec3& centre, const Vec3& axis, double radius, double minor_radius,
                       double angle) {
  switch (type) {
    case SurfaceType::plane: return make_plane(axis, dot(axis, centre));
    case SurfaceType::sphere: return make_sphere(centre, radius);
    case SurfaceType::cylinder: return make_cylinder(centre, axis, radius);
    case SurfaceType::cone: return make_cone(centre, axis, angle);
    default: return make_torus(centre, axis, radius, minor_radius);
  }
}

bool has_apex(SurfaceType type) { return type == SurfaceType::elliptic_cone || type == SurfaceType::plane_pair; }

// Up to rounding.
bool is_on(const Primitive& primitive, const Vec3& p, double scale) {
  const auto* general = std::get_if<GeneralQuadric>(&primitive);
  if (!general) return distance(primitive, p) < 1e-12 * scale;
  Quadric terms;
  for (std::size_t k = 0; k < 10; ++k) terms.c[k] = std::abs(general->polynomial.c[k]);
  return std::abs(value_of(general->polynomial, p)) <=
         1e-14 * value_of(terms, {std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

// Points anywhere, at the centre, on the axes, in planes of symmetry, at centres of curvature, and on the surface.
std::vector<Vec3> awkward_points(const KnownSurface& s, SplitMix64& random) {
  std::vector<Vec3> points{s.centre};
  for (int i = 0; i < 10; ++i) points.push_back(s.centre + random_point(random, 2 * s.scale));
  for (int i = 0; i < 10; ++i) {
    Vec3 local = random_point(random, i % 2 == 0 ? 0.4 * s.scale : 2 * s.scale);
    local[i % 3] = 0;
    points.push_back(s.world(local));
    local[(i + 1) % 3] = 0;
    points.push_back(s.world(local));
    local[(i + 1) % 3] = 1e-9 * s.scale;
    points.push_back(s.world(local));
  }
  points.push_back(s.world(s.point(0.3, -0.4, 0)));
  points.push_back(s.world({s.lengths[0], 0, 0}));
  points.push_back(s.world({0, 0, s.lengths[0]}));
  return points;
}

class EveryType : public testing::TestWithParam<SurfaceType> {};

TEST_P(EveryType, FootPointsAreNearest) {
  SplitMix64 random(1);
  for (int i = 0; i < 8; ++i) {
    const double scale = std::pow(10.0, random.range(-3, 3));
    const KnownSurface s = test::random_surface(GetParam(), random, scale);
    const Primitive primitive = primitive_of(s);
    for (const Vec3& p : awkward_points(s, random)) {
      const Vec3 foot = foot_point(primitive, p);
      EXPECT_TRUE(is_on(primitive, foot, scale));
      EXPECT_LE(norm(foot - p), norm(test::nearest_by_search(s, p) - p) + 1e-10 * scale);
      // Where gradients vanish rounding counts by its root.
      EXPECT_LE(distance(primitive, p), norm(foot - p) + (has_apex(s.type) ? 1e-6 : 1e-12) * scale);
    }
  }
}

TEST_P(EveryType, DistanceIsZeroOnTheSurface) {
  SplitMix64 random(2);
  for (int i = 0; i < 10; ++i) {
    const KnownSurface s = test::random_surface(GetParam(), random);
    const Primitive primitive = primitive_of(s);
    EXPECT_EQ(type_of(primitive), s.type);
    for (int j = 0; j < 20; ++j) {
      const Vec3 p = s.world(s.point(random.range(-1, 1), random.range(-1, 1), j % 2));
      EXPECT_LT(distance(primitive, p), has_apex(s.type) ? 1e-7 : 1e-12);
      if (const auto quadric = quadric_of(primitive)) {
        EXPECT_LT(approximate_distance(*quadric, second_order_of(*quadric), p), 1e-7);
      } else {
        EXPECT_EQ(s.type, SurfaceType::torus);
      }
      EXPECT_LT(norm(foot_point(primitive, p) - p), 1e-10);
    }
  }
}

TEST_P(EveryType, LocalCoordinatesChangeNothing) {
  SplitMix64 random(3);
  for (int i = 0; i < 10; ++i) {
    const Primitive local = primitive_of(test::random_surface(GetParam(), random));
    const Vec3 origin = random_point(random, 100);
    const double scale = random.range(0.01, 50);
    const Primitive world = from_local(local, origin, scale);
    EXPECT_EQ(type_of(world), type_of(local));
    for (int j = 0; j < 10; ++j) {
      const Vec3 p = random_point(random, 4);
      EXPECT_NEAR(distance(world, origin + scale * p), scale * distance(local, p), 1e-10 * (100 + scale));
      const Vec3 foot = foot_point(local, p), there = foot_point(world, origin + scale * p);
      EXPECT_NEAR(norm(there - (origin + scale * p)), scale * norm(foot - p), 1e-10 * (100 + scale));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Types, EveryType,
                         testing::Values(SurfaceType::plane, SurfaceType::sphere, SurfaceType::cylinder,
                                         SurfaceType::cone, SurfaceType::torus, SurfaceType::ellipsoid,
                                         SurfaceType::elliptic_paraboloid, SurfaceType::hyperbolic_paraboloid,
                                         SurfaceType::one_sheet_hyperboloid, SurfaceType::two_sheet_hyperboloid,
                                         SurfaceType::elliptic_cone, SurfaceType::elliptic_cylinder,
                                         SurfaceType::hyperbolic_cylinder, SurfaceType::parabolic_cylinder,
                                         SurfaceType::plane_pair),
                         [](const auto& test) { return std::string(name_of(test.param)); });

TEST(Primitive, NamesDiffer) {
  std::set<std::string> names;
  for (int type = 0; type <= static_cast<int>(SurfaceType::plane_pair); ++type)
    EXPECT_TRUE(names.insert(name_of(static_cast<SurfaceType>(type))).second);
  EXPECT_EQ(names.count(""), 0u);
}

TEST(Primitive, BadParametersAreErrors) {
  const double nan = std::nan("");
  EXPECT_THROW(make_plane({0, 0, 0}, 1), Error);
  EXPECT_THROW(make_sphere({0, 0, 0}, 0), Error);
  EXPECT_THROW(make_sphere({0, 0, 0}, nan), Error);
  EXPECT_THROW(make_cylinder({0, 0, 0}, {0, 0, nan}, 1), Error);
  EXPECT_THROW(make_cylinder({0, 0, 0}, {0, 0, 1}, -1), Error);
  EXPECT_THROW(make_cone({0, 0, 0}, {0, 0, 1}, 0), Error);
  EXPECT_THROW(make_cone({0, 0, 0}, {0, 0, 1}, 2), Error);
  EXPECT_THROW(make_torus({0, 0, 0}, {0, 0, 1}, 1, 2), Error);
  EXPECT_THROW(classify({}, {0, 0, 0}, 0, 0), Error);
  Quadric broken;
  broken.c[4] = nan;
  EXPECT_THROW(classify(broken, {0, 0, 0}, 1, 0), Error);
}

TEST(Primitive, GradientsOfRoundQuadricsAreUnit) {
  SplitMix64 random(4);
  for (const SurfaceType type : {SurfaceType::plane, SurfaceType::sphere, SurfaceType::cylinder, SurfaceType::cone})
    for (int i = 0; i < 10; ++i) {
      const KnownSurface s = test::random_surface(type, random);
      const Primitive primitive = primitive_of(s);
      const Vec3 p = s.world(s.point(random.range(-1, 1), random.range(0.1, 1), 0));
      const double unit = type == SurfaceType::cone ? norm(p - s.centre) : 1;
      EXPECT_NEAR(norm(gradient_of(*quadric_of(primitive), p)), unit, 1e-12);
    }
}

double angle_between_lines(const Vec3& a, const Vec3& b) { return norm(cross(a, b)); }

TEST(Classify, FindsTypeAndParameters) {
  SplitMix64 random(5);
  for (const SurfaceType type : kQuadrics)
    for (int i = 0; i < 20; ++i) {
      const double scale = std::pow(10.0, random.range(-3, 3));
      const KnownSurface s = test::random_surface(type, random, scale, 30);
      Quadric quadric = s.quadric;
      const double factor = random.range(-5, 5);
      for (double& c : quadric.c) c *= factor;
      const Primitive primitive =
          classify(quadric, s.centre + random_point(random, 0.3 * scale), 2.5 * scale, 1e-6 * scale);
      const PrimitiveParameters found = parameters_of(primitive);
      ASSERT_EQ(name_of(found.type), name_of(type)) << i;

      const Vec3 to_centre = found.centre - s.centre;
      const double along = norm(to_centre - dot(to_centre, s.axes[2]) * s.axes[2]);
      for (std::size_t k = 0; k < 3; ++k) EXPECT_TRUE(std::isfinite(found.centre[static_cast<int>(k)]));
      switch (type) {
        case SurfaceType::plane:
          EXPECT_LT(std::abs(dot(to_centre, s.axes[2])), 1e-5 * scale);
          EXPECT_LT(angle_between_lines(found.axis, s.axes[2]), 1e-5);
          break;
        case SurfaceType::sphere:
          EXPECT_LT(norm(to_centre), 1e-5 * scale);
          EXPECT_NEAR(found.radius, s.lengths[0], 1e-5 * scale);
          break;
        case SurfaceType::cylinder:
          EXPECT_LT(along, 1e-5 * scale);
          EXPECT_NEAR(found.radius, s.lengths[0], 1e-5 * scale);
          EXPECT_NEAR(dot(found.centre, found.axis), 0, 1e-9 * scale);
          break;
        case SurfaceType::cone:
          EXPECT_LT(norm(to_centre), 1e-5 * scale);
          EXPECT_NEAR(found.angle, s.lengths[0], 1e-5);
          EXPECT_LT(angle_between_lines(found.axis, s.axes[2]), 1e-5);
          break;
        default: {
          // Lengths tell the axes apart.
          for (std::size_t k = 0; k < 3; ++k) {
            EXPECT_NEAR(found.lengths[k], s.lengths[k], 1e-4 * s.lengths[k]);
            if (s.lengths[k] > 0) {
              EXPECT_LT(angle_between_lines(found.axes[k], s.axes[k]), 1e-4);
            }
          }
          if (type == SurfaceType::elliptic_paraboloid || type == SurfaceType::hyperbolic_paraboloid) {
            EXPECT_NEAR(dot(found.axes[2], s.axes[2]), 1, 1e-8);
          }
          if (type == SurfaceType::elliptic_cylinder || type == SurfaceType::hyperbolic_cylinder) {
            EXPECT_LT(along, 1e-4 * scale);
          } else if (type == SurfaceType::plane_pair) {
            EXPECT_LT(distance(primitive, s.centre), 1e-5 * scale + (s.lengths[1] > 0 ? 0 : s.lengths[0]));
          } else if (type == SurfaceType::parabolic_cylinder) {
            EXPECT_LT(norm(to_centre - dot(to_centre, s.axes[1]) * s.axes[1]), 1e-4 * scale);
          } else {
            EXPECT_LT(norm(to_centre), 1e-4 * scale);
          }
          break;
        }
      }
    }
}

// x^2 / a^2 - y^2 / b^2 = h differs from two planes by what the vertices are apart, at most.
TEST(Classify, TakesPlanePairsByDistance) {
  SplitMix64 random(6);
  for (int i = 0; i < 20; ++i) {
    const auto axes = test::random_frame(random);
    const Vec3 centre = random_point(random, 5);
    const double gap = std::pow(10.0, random.range(-4, -2));
    const double lambda = -random.range(0.5, 1);
    const Quadric quadric = test::placed(axes, centre, {1, lambda, 0}, 0, -gap * gap);
    EXPECT_EQ(type_of(classify(quadric, centre, 1, 1.1 * gap)), SurfaceType::plane_pair);
    EXPECT_EQ(type_of(classify(quadric, centre, 1, 0.1 * gap)), SurfaceType::hyperbolic_cylinder);
    // Far along the asymptote one plane is enough.
    const double slope = std::sqrt(-1 / lambda);
    const Vec3 far = centre + 100.0 * axes[0] + (100 * slope) * axes[1];
    EXPECT_EQ(type_of(classify(quadric, far, 1, gap)), SurfaceType::plane);
  }
}

// Whatever the type found, it is as near to the quadric as was asked for.
TEST(Classify, KeepsToTheTolerance) {
  SplitMix64 random(7);
  for (const SurfaceType type : kQuadrics)
    for (int i = 0; i < 10; ++i) {
      const KnownSurface s = test::random_surface(type, random, 1, 1);
      Quadric quadric = s.quadric;
      for (double& c : quadric.c) c += 0.003 * random.range(-1, 1);
      const Primitive exact = classify(quadric, s.centre, 1.5, 0), simple = classify(quadric, s.centre, 1.5, 0.02);
      for (int j = 0; j < 50; ++j) {
        const Vec3 p = foot_point(exact, s.centre + random_point(random, 1));
        if (norm(p - s.centre) > 1.5) continue;
        EXPECT_LT(norm(foot_point(simple, p) - p), 0.04) << name_of(type) << ' ' << name_of(type_of(simple));
      }
    }
}

TEST(Classify, QuadricsWithoutPointsAreFinite) {
  SplitMix64 random(8);
  for (int i = 0; i < 60; ++i) {
    const auto axes = test::random_frame(random);
    const Vec3 centre = random_point(random, 2);
    const int rank = i % 4;
    const double c = i % 8 < 4 ? 1 : 1e-12;
    const Quadric quadric =
        test::placed(axes, centre, {rank > 0 ? 1.0 : 0.0, rank > 1 ? 0.5 : 0.0, rank > 2 ? 0.3 : 0.0}, 0, c);
    const Primitive found = classify(quadric, centre, 1, 1e-6);
    const std::optional<Quadric> polynomial = quadric_of(found);
    ASSERT_TRUE(polynomial.has_value());
    for (double x : polynomial->c) EXPECT_TRUE(std::isfinite(x));
    for (const Vec3& v :
         {parameters_of(found).centre, parameters_of(found).axis, foot_point(found, random_point(random, 3))})
      EXPECT_TRUE(std::isfinite(norm2(v)));
    EXPECT_TRUE(std::isfinite(distance(found, {1, 2, 3})));
  }
  EXPECT_EQ(type_of(classify({}, {1, 2, 3}, 1, 0.1)), SurfaceType::plane);
}

TEST(Classify, EigenvaluesOfAnySizeGiveASurface) {
  SplitMix64 random(9);
  for (int i = 0; i < 2000; ++i) {
    // In turned frames rounding sets small eigenvalues.
    const std::array<Vec3, 3> axes = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
    const Vec3 centre;
    std::array<double, 3> lambda;
    for (double& x : lambda) x = (random.unit() < 0.5 ? -1 : 1) * std::pow(10.0, random.range(-80, 0));
    const double c = i % 3 == 0 ? 0 : random.range(-1, 1) * std::pow(10.0, i % 3 == 1 ? 0 : random.range(-80, 0));
    const Quadric quadric = test::placed(axes, centre, {lambda[0], lambda[1], lambda[2]}, 0, c);
    Primitive found;
    ASSERT_NO_THROW(found = classify(quadric, centre, 1, 1e-9)) << i;
    EXPECT_TRUE(std::isfinite(distance(found, centre + random_point(random, 1)))) << i;
  }
}

// ---- Fits.

// Of a patch of `arc` radians each way, or as long; normals with noise as points.
SurfaceSamples samples_of(const KnownSurface& s, SplitMix64& random, std::size_t count, double arc, double noise,
                          double normal_noise, double start = 0) {
  SurfaceSamples samples;
  for (std::size_t i = 0; i < count; ++i) {
    const double u = (start + arc * random.unit()) / 1.05;
    const double v = s.type == SurfaceType::cone     ? 0.3 + 0.5 * random.unit()
                     : s.type == SurfaceType::sphere ? std::min(arc, 3.0) * (random.unit() - 0.5)
                                                     : arc / 1.05 * (random.unit() - 0.5);
    const Vec3 p = s.world(s.point(u, v, 0));
    const double h = 1e-5;
    Vec3 n = cross(s.world(s.point(u + h, v, 0)) - p, s.world(s.point(u, v + h, 0)) - p);
    n *= 1 / norm(n);
    samples.points.push_back(p + noise * s.scale * gaussian(random) * n);
    n += normal_noise * Vec3{gaussian(random), gaussian(random), gaussian(random)};
    samples.normals.push_back((1 / norm(n)) * n);
    samples.weights.push_back(random.range(0.5, 1.5));
  }
  return samples;
}

double squared_distance(const Primitive& primitive, const SurfaceSamples& samples) {
  double sum = 0;
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    const double d = distance(primitive, samples.points[i]);
    sum += samples.weights[i] * d * d;
  }
  return sum;
}

void expect_close(const Primitive& found_one, const Primitive& known_one, double tolerance) {
  const PrimitiveParameters found = parameters_of(found_one), known = parameters_of(known_one);
  ASSERT_EQ(found.type, known.type);
  EXPECT_NEAR(found.radius, known.radius, tolerance);
  EXPECT_NEAR(found.minor_radius, known.minor_radius, tolerance);
  EXPECT_NEAR(found.angle, known.angle, tolerance);
  EXPECT_LT(norm(found.centre - known.centre), tolerance);
  if (found.type == SurfaceType::cone) {
    EXPECT_LT(norm(found.axis - known.axis), tolerance);
  } else if (found.type != SurfaceType::sphere) {
    EXPECT_LT(angle_between_lines(found.axis, known.axis), tolerance);
  }
}

class Fit : public testing::TestWithParam<SurfaceType> {};

TEST_P(Fit, RecoversExactSurfaces) {
  SplitMix64 random(11);
  for (const double arc : {kPi / 3, 2 * kPi})
    for (int i = 0; i < 25; ++i) {
      const KnownSurface s = test::random_surface(GetParam(), random);
      const SurfaceSamples samples = samples_of(s, random, 150, arc, 0, 0, random.range(0, 6));
      const auto fit = fit_primitive(GetParam(), samples);
      ASSERT_TRUE(fit) << i;
      expect_close(fit->primitive, primitive_of(s), 1e-9);
      EXPECT_LT(fit->squared_distance, 1e-20);
    }
}

TEST_P(Fit, IsAsNearAsTheTruthUnderNoise) {
  SplitMix64 random(12);
  for (const double arc : {kPi / 3, 2 * kPi})
    for (int i = 0; i < 15; ++i) {
      const KnownSurface s = test::random_surface(GetParam(), random);
      const double noise = arc < 2 ? 0.002 : 0.05;
      const SurfaceSamples samples = samples_of(s, random, 200, arc, noise, arc < 2 ? 0.05 : 0.2, random.range(0, 6));
      const auto fit = fit_primitive(GetParam(), samples);
      ASSERT_TRUE(fit) << i;
      const double truth = squared_distance(primitive_of(s), samples);
      EXPECT_LE(fit->squared_distance, truth * (1 + 1e-9));
      EXPECT_NEAR(fit->squared_distance, squared_distance(fit->primitive, samples), 1e-9 * truth);
      if (arc > 2) {
        const PrimitiveParameters found = parameters_of(fit->primitive), known = parameters_of(primitive_of(s));
        EXPECT_NEAR(found.radius, known.radius, 0.1);
        EXPECT_NEAR(found.minor_radius, known.minor_radius, 0.1);
      }
    }
}

// No small change of any parameter helps: the Jacobian is right.
TEST_P(Fit, IsALocalMinimum) {
  SplitMix64 random(13);
  for (int i = 0; i < 10; ++i) {
    const SurfaceSamples samples = samples_of(test::random_surface(GetParam(), random), random, 100, 3, 0.02, 0.1);
    const auto fit = fit_primitive(GetParam(), samples);
    ASSERT_TRUE(fit);
    const PrimitiveParameters best = parameters_of(fit->primitive);
    for (int j = 0; j < 60; ++j) {
      const double step = std::pow(10.0, -2 - j % 3);
      const Vec3 centre = best.centre + random_point(random, step), axis = best.axis + random_point(random, step);
      const double a = step * random.range(-1, 1), b = step * random.range(-1, 1);
      const Primitive other =
          primitive_of(GetParam(), centre, axis, best.radius + a, best.minor_radius + b, best.angle + a);
      EXPECT_GE(squared_distance(other, samples), fit->squared_distance * (1 - 1e-6));
    }
  }
}

TEST_P(Fit, WeightsCountPoints) {
  SplitMix64 random(14);
  const KnownSurface s = test::random_surface(GetParam(), random);
  SurfaceSamples samples = samples_of(s, random, 60, 3, 0.02, 0.1);
  for (std::size_t i = 0; i < 60; ++i) samples.weights[i] = 1.0 + static_cast<double>(i % 2);
  SurfaceSamples repeated = samples;
  for (std::size_t i = 1; i < 60; i += 2) {
    repeated.points.push_back(samples.points[i]);
    repeated.normals.push_back(samples.normals[i]);
    repeated.weights.push_back(1);
    repeated.weights[i] = 1;
  }
  const auto a = fit_primitive(GetParam(), samples), b = fit_primitive(GetParam(), repeated);
  ASSERT_TRUE(a && b);
  expect_close(a->primitive, b->primitive, 1e-3);
  EXPECT_NEAR(a->squared_distance, b->squared_distance, 1e-6 * a->squared_distance);
  // Points of no weight do not count, wherever they are.
  for (int i = 0; i < 20; ++i) {
    samples.points.push_back(random_point(random, 100));
    samples.normals.push_back({1, 0, 0});
    samples.weights.push_back(0);
  }
  const auto c = fit_primitive(GetParam(), samples);
  ASSERT_TRUE(c);
  expect_close(c->primitive, a->primitive, 1e-12);
}

TEST_P(Fit, FollowsScaleAndPlace) {
  SplitMix64 random(15);
  for (const double scale : {1e-6, 1e6}) {
    const KnownSurface s = test::random_surface(GetParam(), random);
    SurfaceSamples samples = samples_of(s, random, 100, 3, 0, 0);
    const PrimitiveParameters known = parameters_of(primitive_of(s));
    const Vec3 origin{3e4, -2e4, 1e4};
    for (Vec3& p : samples.points) p = scale * (p + origin);
    const auto fit = fit_primitive(GetParam(), samples);
    ASSERT_TRUE(fit);
    const PrimitiveParameters found = parameters_of(fit->primitive);
    EXPECT_NEAR(found.radius, scale * known.radius, 1e-8 * scale);
    EXPECT_NEAR(found.minor_radius, scale * known.minor_radius, 1e-8 * scale);
    EXPECT_NEAR(found.angle, known.angle, 1e-8);
    for (const Vec3& p : samples.points) EXPECT_LT(distance(fit->primitive, p), 1e-8 * scale);
  }
}

TEST_P(Fit, RefinesAStart) {
  SplitMix64 random(16);
  for (int i = 0; i < 10; ++i) {
    const KnownSurface s = test::random_surface(GetParam(), random);
    const SurfaceSamples samples = samples_of(s, random, 100, 3, 0, 0);
    const Primitive known = primitive_of(s);
    PrimitiveParameters p = parameters_of(known);
    p.centre += random_point(random, 0.05);
    p.axis += random_point(random, 0.05);
    p.radius *= random.range(0.95, 1.05);
    const Primitive start = primitive_of(p.type, p.centre, p.axis, p.radius, p.minor_radius, p.angle);
    const auto fit = refine_primitive(start, samples);
    ASSERT_TRUE(fit);
    expect_close(fit->primitive, known, 1e-9);
  }
}

TEST_P(Fit, NeedsPointsThatDetermineIt) {
  SplitMix64 random(17);
  const KnownSurface s = test::random_surface(GetParam(), random);
  const SurfaceSamples few = samples_of(s, random, 2, 2, 0, 0);
  EXPECT_FALSE(fit_primitive(GetParam(), few));
  SurfaceSamples repeated;
  for (int i = 0; i < 30; ++i) {
    repeated.points.push_back(few.points[static_cast<std::size_t>(i % 2)]);
    repeated.normals.push_back(few.normals[static_cast<std::size_t>(i % 2)]);
    repeated.weights.push_back(1);
  }
  EXPECT_FALSE(fit_primitive(GetParam(), repeated));
  EXPECT_FALSE(fit_primitive(GetParam(), {}));
  EXPECT_FALSE(refine_primitive(primitive_of(s), {}));
  // On a line.
  SurfaceSamples line;
  for (int i = 0; i < 30; ++i) {
    line.points.push_back(s.centre + (0.1 * i) * s.axes[0]);
    line.normals.push_back(s.axes[1]);
    line.weights.push_back(1);
  }
  EXPECT_FALSE(fit_primitive(GetParam(), line));
}

INSTANTIATE_TEST_SUITE_P(Types, Fit, testing::ValuesIn(kRound),
                         [](const auto& test) { return std::string(name_of(test.param)); });

TEST(Fits, OfSimplerSurfacesAreNone) {
  SplitMix64 random(18);
  const auto none = [&](SurfaceType of, SurfaceType as, double noise) {
    for (int i = 0; i < 5; ++i) {
      const KnownSurface s = test::random_surface(of, random);
      const SurfaceSamples samples = samples_of(s, random, 200, 2, noise, noise);
      EXPECT_FALSE(fit_primitive(as, samples)) << name_of(of) << " as " << name_of(as) << " with noise of " << noise;
    }
  };
  for (const double noise : {0.0, 0.01}) {
    for (const SurfaceType type : {SurfaceType::sphere, SurfaceType::cylinder, SurfaceType::cone, SurfaceType::torus})
      none(SurfaceType::plane, type, noise);
    none(SurfaceType::sphere, SurfaceType::torus, noise);
    none(SurfaceType::cylinder, SurfaceType::cone, noise);
  }
  none(SurfaceType::cylinder, SurfaceType::torus, 0);
  none(SurfaceType::cone, SurfaceType::torus, 0);
}

TEST(Fits, OfConesPointTheirAxisAtTheData) {
  SplitMix64 random(19);
  for (int i = 0; i < 20; ++i) {
    const KnownSurface s = test::random_surface(SurfaceType::cone, random);
    const SurfaceSamples samples = samples_of(s, random, 100, 6, 0, 0);
    const auto fit = fit_primitive(SurfaceType::cone, samples);
    ASSERT_TRUE(fit);
    EXPECT_LT(norm(std::get<Cone>(fit->primitive).axis - s.axes[2]), 1e-9);
  }
}

TEST(Fits, BadInputIsAnError) {
  SplitMix64 random(20);
  const KnownSurface s = test::random_surface(SurfaceType::sphere, random);
  SurfaceSamples samples = samples_of(s, random, 20, 2, 0, 0);
  EXPECT_THROW(fit_primitive(SurfaceType::ellipsoid, samples), Error);
  samples.weights[3] = -1;
  EXPECT_THROW(fit_primitive(SurfaceType::sphere, samples), Error);
  samples.weights[3] = 1;
  samples.points[3].y = INFINITY;
  EXPECT_THROW(fit_primitive(SurfaceType::sphere, samples), Error);
  samples.points.pop_back();
  EXPECT_THROW(fit_primitive(SurfaceType::sphere, samples), Error);
}

TEST(RefineQuadric, NeverGetsWorseAndFindsExactQuadrics) {
  SplitMix64 random(21);
  for (const SurfaceType type : {SurfaceType::ellipsoid, SurfaceType::one_sheet_hyperboloid,
                                 SurfaceType::elliptic_paraboloid, SurfaceType::elliptic_cylinder})
    for (const double noise : {0.0, 0.01})
      for (int i = 0; i < 5; ++i) {
        const KnownSurface s = test::random_surface(type, random);
        const SurfaceSamples samples = samples_of(s, random, 200, 1.5, noise, 0.1);
        Quadric start = s.quadric;
        for (double& c : start.c) c *= 1 + 0.02 * random.range(-1, 1);
        const Primitive first = classify(start, s.centre, 2, 0);
        const PrimitiveFit fit = refine_quadric(first, samples);
        EXPECT_LE(fit.squared_distance, squared_distance(first, samples) * (1 + 1e-9));
        EXPECT_NEAR(fit.squared_distance, squared_distance(fit.primitive, samples),
                    1e-6 * fit.squared_distance + 1e-14);
        if (noise == 0) {
          EXPECT_LT(fit.squared_distance, 1e-14);
        } else {
          EXPECT_LT(fit.squared_distance, 1.05 * squared_distance(primitive_of(s), samples));
        }
      }
}

}  // namespace
}  // namespace bisector
