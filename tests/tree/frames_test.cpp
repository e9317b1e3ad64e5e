#include "tree/frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bisector/error.h"
#include "support/models.h"

namespace bisector {
namespace {

using test::SplitMix64;

std::vector<double> evenly(int count) {
  std::vector<double> t;
  for (int i = 0; i <= count; ++i) t.push_back(static_cast<double>(i) / count);
  return t;
}

// Bishop's equation r' = -(r . t') t (There is more than one way to frame a curve, 1975) by Runge and Kutta's method
// with `steps` steps in each knot interval, from the frame's first normal to each of the parameters `evenly(count)`.
std::vector<Vec3> bishop(const BSplineCurve& curve, const Vec3& first, int count, int steps) {
  const auto slope = [&](double t, const Vec3& r) {
    const Vec3 d = curve.derivative(t), dd = curve.second_derivative(t), tangent = unit(d);
    const Vec3 turn = (1 / norm(d)) * (dd - dot(dd, tangent) * tangent);
    return -dot(r, turn) * tangent;
  };
  std::vector<double> stops = evenly(count);
  for (double knot : curve.knots) stops.push_back(knot);
  std::sort(stops.begin(), stops.end());
  std::vector<Vec3> normals{first};
  Vec3 r = first;
  for (std::size_t i = 1; i < stops.size(); ++i) {
    const double from = stops[i - 1], h = (stops[i] - from) / steps;
    // Derivatives jump at knots: the interval's own are taken just inside.
    const double inside = 1e-12;
    for (int k = 0; k < steps && h > 0; ++k) {
      const double a = from + k * h;
      const Vec3 k1 = slope(a + (k == 0 ? inside : 0), r), k2 = slope(a + 0.5 * h, r + (0.5 * h) * k1);
      const Vec3 k3 = slope(a + 0.5 * h, r + (0.5 * h) * k2),
                 k4 = slope(a + h - (k + 1 == steps ? inside : 0), r + h * k3);
      r += (h / 6) * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    if (h > 0 && static_cast<std::size_t>(stops[i] * count + 1e-9) == normals.size() &&
        std::abs(stops[i] - static_cast<double>(normals.size()) / count) < 1e-12)
      normals.push_back(r);
  }
  return normals;
}

void expect_no_twist(const BSplineCurve& curve, int steps = 400) {
  const int count = 20;
  const std::vector<Frame> frames = rotation_minimising_frames(curve, evenly(count));
  const std::vector<Vec3> fine = bishop(curve, frames[0].normal, count, steps);
  ASSERT_EQ(frames.size(), fine.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame& f = frames[i];
    EXPECT_LT(norm(f.position - curve.point(static_cast<double>(i) / count)), 1e-12);
    EXPECT_LT(norm(f.tangent - unit(curve.derivative(static_cast<double>(i) / count))), 1e-12);
    EXPECT_NEAR(norm(f.normal), 1, 1e-12);
    EXPECT_NEAR(norm(f.binormal), 1, 1e-12);
    EXPECT_NEAR(dot(f.normal, f.tangent), 0, 1e-12);
    EXPECT_LT(norm(cross(f.normal, f.binormal) - f.tangent), 1e-12);
    // The angle about the tangent.
    EXPECT_LT(std::abs(std::atan2(dot(fine[i], f.binormal), dot(fine[i], f.normal))), 1e-6) << "at " << i;
  }
}

BSplineCurve fitted(const std::vector<Vec3>& points, double tolerance) { return fit_curve(points, tolerance).curve; }

TEST(Frames, HelixFollowsItsKnownRotation) {
  const double pitch = 0.4, turns = 2;
  std::vector<Vec3> points;
  for (int i = 0; i <= 200; ++i) {
    const double a = 2 * M_PI * turns * i / 200;
    points.push_back({std::cos(a), std::sin(a), pitch * a});
  }
  const BSplineCurve curve = fitted(points, 1e-4);
  expect_no_twist(curve);
  // Against the Frenet frame of a helix the rotation-minimising one turns by the torsion times the length: here by
  // 2 pi turns pitch / sqrt(1 + pitch^2).
  const std::vector<Frame> frames = rotation_minimising_frames(curve, {0, 1});
  const auto frenet_angle = [](const Frame& f, double a) {
    const Vec3 inwards{-std::cos(a), -std::sin(a), 0};
    return std::atan2(dot(inwards, f.binormal), dot(inwards, f.normal));
  };
  const double turned = frenet_angle(frames[1], 2 * M_PI * turns) - frenet_angle(frames[0], 0);
  const double expected = 2 * M_PI * turns * pitch / std::sqrt(1 + pitch * pitch);
  EXPECT_NEAR(std::remainder(turned - expected, 2 * M_PI), 0, 0.02);
}

TEST(Frames, InflectionsDoNotFlipTheNormal) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 60; ++i) {
    const double a = -3 + i / 10.0;
    points.push_back({a, a * a * a / 9, 0.3 * std::sin(a)});
  }
  const BSplineCurve curve = fitted(points, 1e-3);
  expect_no_twist(curve);
  const std::vector<Frame> frames = rotation_minimising_frames(curve, evenly(200));
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_GT(dot(frames[i].normal, frames[i - 1].normal), 0.9);
}

TEST(Frames, StraightLinesKeepTheFrame) {
  for (const Vec3& to : {Vec3{0, 0, 5}, Vec3{1, -2, 3}, Vec3{-4, 0, 0}}) {
    const std::vector<Frame> frames = rotation_minimising_frames(fitted({{0, 0, 0}, to}, 0), evenly(10));
    for (const Frame& f : frames) {
      EXPECT_LT(norm(f.normal - frames[0].normal), 1e-13);
      EXPECT_LT(norm(f.tangent - unit(to)), 1e-13);
    }
  }
}

TEST(Frames, PlanarCurvesKeepTheirPlane) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 40; ++i) points.push_back({i / 4.0, std::sin(i / 4.0), 0});
  const BSplineCurve curve = fitted(points, 1e-3);
  expect_no_twist(curve);
  const std::vector<Frame> frames = rotation_minimising_frames(curve, evenly(30));
  const double height = frames[0].normal.z;
  for (const Frame& f : frames) EXPECT_NEAR(f.normal.z, height, 1e-12);
}

TEST(Frames, RandomFits) {
  SplitMix64 random(11);
  for (int trial = 0; trial < 10; ++trial) {
    std::vector<Vec3> points{{0, 0, 0}};
    Vec3 heading{0, 0, 1};
    for (int i = 0; i < 30; ++i) {
      heading = unit(heading + Vec3{random.range(-0.4, 0.4), random.range(-0.4, 0.4), random.range(-0.4, 0.4)});
      points.push_back(points.back() + heading);
    }
    expect_no_twist(fitted(points, 0.1));
  }
}

TEST(Frames, SharpBends) {
  // A turn of a right angle within a hundredth of the length, out of one plane into another.
  const BSplineCurve curve{
      3,
      {0, 0, 0, 0, 0.49, 0.5, 0.51, 1, 1, 1, 1},
      {{0, 0, 0}, {0, 0, 0.5}, {0, 0, 0.98}, {0, 0.01, 1}, {0.02, 0.02, 1}, {0.5, 0.3, 1}, {1, 1, 1.2}}};
  expect_no_twist(curve, 4000);
}

TEST(Frames, FewParametersGiveTheSameFrames) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 60; ++i) points.push_back({std::cos(i / 9.0), std::sin(i / 9.0), i * i / 600.0});
  const BSplineCurve curve = fitted(points, 1e-3);
  const Frame few = rotation_minimising_frames(curve, {1}).back();
  const Frame many = rotation_minimising_frames(curve, evenly(777)).back();
  EXPECT_LT(norm(few.normal - many.normal), 1e-6);
  EXPECT_TRUE(rotation_minimising_frames(curve, {}).empty());
}

TEST(Frames, ParametersThatAreEqualButForRoundingAreHarmless) {
  SplitMix64 random(5);
  std::vector<Vec3> points;
  for (int i = 0; i <= 60; ++i) points.push_back({std::cos(i / 9.0), std::sin(i / 9.0), i * i / 600.0});
  const BSplineCurve curve = fitted(points, 1e-3);
  std::vector<double> t;
  for (int k = 0; k < 20000; ++k) {
    t.push_back(random.unit());
    for (int more = 0; more < 3; ++more) t.push_back(std::nextafter(t.back(), 1));
  }
  std::sort(t.begin(), t.end());
  const std::vector<Frame> frames = rotation_minimising_frames(curve, t);
  for (std::size_t i = 1; i < frames.size(); ++i) ASSERT_GT(dot(frames[i].normal, frames[i - 1].normal), 0.99) << t[i];
  EXPECT_LT(norm(frames.back().normal - rotation_minimising_frames(curve, {t.back()}).back().normal), 1e-6);
}

TEST(Frames, FarFromTheOriginTheyAreTheSame) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 60; ++i) points.push_back({std::cos(i / 9.0), std::sin(i / 9.0), i * i / 600.0});
  const BSplineCurve curve = fitted(points, 1e-3);
  BSplineCurve far = curve;
  for (Vec3& c : far.control) c += Vec3{5e5, -4e6, 100};
  const std::vector<Frame> a = rotation_minimising_frames(curve, evenly(50)),
                           b = rotation_minimising_frames(far, evenly(50));
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_LT(norm(a[i].normal - b[i].normal), 1e-6);
    EXPECT_TRUE(b[i].position == far.point(static_cast<double>(i) / 50));
  }
}

TEST(Frames, TurningBackIsNoNan) {
  const BSplineCurve curve = fitted({{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}, 1e-3);
  for (const Frame& f : rotation_minimising_frames(curve, evenly(64))) {
    EXPECT_NEAR(norm(f.tangent), 1, 1e-12);
    EXPECT_NEAR(norm(f.normal), 1, 1e-12);
    EXPECT_NEAR(dot(f.tangent, f.normal), 0, 1e-12);
  }
}

TEST(Frames, BadInputIsRefused) {
  const BSplineCurve line = fitted({{0, 0, 0}, {1, 0, 0}}, 0);
  EXPECT_THROW(rotation_minimising_frames(line, {0.5, 0.4}), Error);
  EXPECT_THROW(rotation_minimising_frames(line, {-0.1}), Error);
  EXPECT_THROW(rotation_minimising_frames(line, {std::nan("")}), Error);
  EXPECT_THROW(rotation_minimising_frames({1, {0, 0, 1, 1}, {{1, 1, 1}, {1, 1, 1}}}, {0}), Error);
}

}  // namespace
}  // namespace bisector
