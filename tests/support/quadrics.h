// Quadrics and tori of every type in random places, with parametrisations to search for nearest points by brute force.
#pragma once

#include <functional>
#include <vector>

#include "segment/primitive.h"
#include "support/models.h"

namespace bisector::test {

struct KnownSurface {
  SurfaceType type;
  Quadric quadric;  // all 0 for a torus
  Vec3 centre;      // as in Primitive, but any point of a cylinder's axis or of a plane
  std::array<Vec3, 3> axes;
  std::array<double, 3> lengths;  // as in Primitive; radius, minor radius and angle of round surfaces first
  double scale;                   // parameters between -3 and 3 cover what is within some scales of the centre
  std::function<Vec3(double, double, int)> point;  // of sheet 0 or 1, in canonical coordinates

  Vec3 world(const Vec3& local) const { return centre + local.x * axes[0] + local.y * axes[1] + local.z * axes[2]; }
};

inline std::array<Vec3, 3> random_frame(SplitMix64& random) {
  const auto direction = [&] {
    Vec3 v;
    do v = {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    while (norm2(v) > 1 || norm2(v) < 0.01);
    return (1 / norm(v)) * v;
  };
  const Vec3 x = direction();
  Vec3 y = cross(x, direction());
  while (norm2(y) < 0.01) y = cross(x, direction());
  y *= 1 / norm(y);
  return {x, y, cross(x, y)};
}

// sum of lambda_k z_k^2 + b z_2 + c, in coordinates z along the axes from the centre.
inline Quadric placed(const std::array<Vec3, 3>& axes, const Vec3& centre, const std::array<double, 3>& lambda,
                      double b, double c) {
  Quadric q;
  q.c[0] = c;
  for (int i = 0; i < 3; ++i) q.c[static_cast<std::size_t>(i) + 1] = b * axes[2][i];
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& a = axes[k];
    const double l = lambda[k];
    const double terms[6]{a.x * a.x, 2 * a.x * a.y, 2 * a.x * a.z, a.y * a.y, 2 * a.y * a.z, a.z * a.z};
    for (std::size_t i = 0; i < 6; ++i) q.c[4 + i] += l * terms[i];
  }
  return from_local(q, centre, 1);
}

// `scale` is the size of the surface, `away` the distance of its centre from the origin at most, in scales.
inline KnownSurface random_surface(SurfaceType type, SplitMix64& random, double scale = 1, double away = 3) {
  KnownSurface s;
  s.type = type;
  s.axes = random_frame(random);
  s.scale = scale;
  s.centre = (scale * away) * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
  // Far enough apart to be told from round ones.
  const double b = scale * random.range(0.3, 0.6), a = scale * random.range(0.8, 1.2), c = scale * random.range(1.5, 2);
  const double ia = 1 / (a * a), ib = 1 / (b * b), ic = 1 / (c * c);
  const auto quadric = [&](double x, double y, double z, double linear, double constant) {
    return placed(s.axes, s.centre, {x, y, z}, linear, constant);
  };
  switch (type) {
    case SurfaceType::plane:
      s.quadric = quadric(0, 0, 0, 1, 0);
      s.point = [=](double u, double v, int) { return scale * Vec3{u, v, 0}; };
      break;
    case SurfaceType::sphere:
      s.quadric = quadric(ia, ia, ia, 0, -1);
      s.lengths = {a, 0, 0};
      s.point = [=](double u, double v, int) {
        return a * Vec3{std::cos(u * 1.05) * std::cos(v), std::sin(u * 1.05) * std::cos(v), std::sin(v)};
      };
      break;
    case SurfaceType::cylinder:
      s.quadric = quadric(ia, ia, 0, 0, -1);
      s.lengths = {a, 0, 0};
      s.point = [=](double u, double v, int) {
        return Vec3{a * std::cos(u * 1.05), a * std::sin(u * 1.05), 2 * scale * v};
      };
      break;
    case SurfaceType::cone: {
      const double angle = random.range(0.2, 1.3), t = std::tan(angle);
      s.quadric = quadric(1, 1, -t * t, 0, 0);
      s.lengths = {angle, 0, 0};
      s.point = [=](double u, double v, int) {
        return 2 * scale * v *
               Vec3{std::sin(angle) * std::cos(u * 1.05), std::sin(angle) * std::sin(u * 1.05), std::cos(angle)};
      };
      break;
    }
    case SurfaceType::torus:
      s.lengths = {a, b, 0};
      s.point = [=](double u, double v, int) {
        const double rho = a + b * std::cos(v * 1.05);
        return Vec3{rho * std::cos(u * 1.05), rho * std::sin(u * 1.05), b * std::sin(v * 1.05)};
      };
      break;
    case SurfaceType::ellipsoid:
      s.quadric = quadric(ic, ia, ib, 0, -1);
      s.lengths = {c, a, b};
      s.point = [=](double u, double v, int) {
        return Vec3{c * std::cos(u * 1.05) * std::cos(v), a * std::sin(u * 1.05) * std::cos(v), b * std::sin(v)};
      };
      break;
    case SurfaceType::elliptic_paraboloid:
    case SurfaceType::hyperbolic_paraboloid: {
      const double sign = type == SurfaceType::elliptic_paraboloid ? 1 : -1;
      const double x2 = sign > 0 ? a : b, y2 = sign > 0 ? b : a;
      s.quadric = quadric(1 / (2 * x2), sign / (2 * y2), 0, -1, 0);
      s.lengths = {x2, y2, 0};
      s.point = [=](double u, double v, int) {
        const double x = 2 * scale * u, y = 2 * scale * v;
        return Vec3{x, y, x * x / (2 * x2) + sign * y * y / (2 * y2)};
      };
      break;
    }
    case SurfaceType::one_sheet_hyperboloid:
      s.quadric = quadric(ia, ib, -ic, 0, -1);
      s.lengths = {a, b, c};
      s.point = [=](double u, double v, int) {
        return Vec3{a * std::cosh(v) * std::cos(u * 1.05), b * std::cosh(v) * std::sin(u * 1.05), c * std::sinh(v)};
      };
      break;
    case SurfaceType::two_sheet_hyperboloid:
      s.quadric = quadric(-ia, -ib, ic, 0, -1);
      s.lengths = {a, b, c};
      s.point = [=](double u, double v, int sheet) {
        return Vec3{a * std::sinh(v) * std::cos(u * 1.05), b * std::sinh(v) * std::sin(u * 1.05),
                    (sheet == 0 ? c : -c) * std::cosh(v)};
      };
      break;
    case SurfaceType::elliptic_cone: {
      const double p = a / scale, q = b / scale;
      s.quadric = quadric(1 / (p * p), 1 / (q * q), -1, 0, 0);
      s.lengths = {p, q, 1};
      s.point = [=](double u, double v, int) {
        return 2 * scale * v * Vec3{p * std::cos(u * 1.05), q * std::sin(u * 1.05), 1};
      };
      break;
    }
    case SurfaceType::elliptic_cylinder:
      s.quadric = quadric(ia, ib, 0, 0, -1);
      s.lengths = {a, b, 0};
      s.point = [=](double u, double v, int) {
        return Vec3{a * std::cos(u * 1.05), b * std::sin(u * 1.05), 2 * scale * v};
      };
      break;
    case SurfaceType::hyperbolic_cylinder:
      s.quadric = quadric(ia, -ib, 0, 0, -1);
      s.lengths = {a, b, 0};
      s.point = [=](double u, double v, int sheet) {
        return Vec3{(sheet == 0 ? a : -a) * std::cosh(u), b * std::sinh(u), 2 * scale * v};
      };
      break;
    case SurfaceType::parabolic_cylinder:
      s.quadric = quadric(1 / (2 * b), 0, 0, -1, 0);
      s.lengths = {b, 0, 0};
      s.point = [=](double u, double v, int) {
        const double x = 2 * scale * u;
        return Vec3{x, 2 * scale * v, x * x / (2 * b)};
      };
      break;
    case SurfaceType::plane_pair: {
      const double length = std::hypot(a, b);
      const bool parallel = random.unit() < 0.3;
      s.quadric = parallel ? quadric(ib, 0, 0, 0, -1) : quadric(ia, -ib, 0, 0, 0);
      s.lengths = parallel ? std::array<double, 3>{b, 0, 0} : std::array<double, 3>{a / length, b / length, 0};
      s.point = [=](double u, double v, int sheet) {
        if (parallel) return Vec3{sheet == 0 ? b : -b, 2 * scale * u, 2 * scale * v};
        return 2 * scale * Vec3{a / length * u, (sheet == 0 ? b : -b) / length * u, v};
      };
      break;
    }
  }
  return s;
}

// A point of the surface about as near to p as any: the best of a grid of parameters, improved by smaller and smaller
// steps.
inline Vec3 nearest_by_search(const KnownSurface& s, const Vec3& p) {
  constexpr int kSteps = 36, kRefined = 4;
  struct Candidate {
    double d2, u, v;
    int sheet;
  };
  const auto candidate = [&](double u, double v, int sheet) {
    return Candidate{norm2(s.world(s.point(u, v, sheet)) - p), u, v, sheet};
  };
  std::vector<Candidate> best;
  for (int sheet = 0; sheet < 2; ++sheet)
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j) {
        const Candidate c = candidate(-3 + 6.0 * i / kSteps, -3 + 6.0 * j / kSteps, sheet);
        std::size_t place = best.size();
        while (place > 0 && c.d2 < best[place - 1].d2) --place;
        if (place >= kRefined) continue;
        best.insert(best.begin() + static_cast<std::ptrdiff_t>(place), c);
        if (best.size() > kRefined) best.pop_back();
      }
  Candidate nearest = best[0];
  for (Candidate c : best) {
    for (double step = 6.0 / kSteps; step > 1e-9; step /= 2)
      for (bool moved = true; moved;) {
        moved = false;
        for (const auto& [du, dv] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}) {
          const Candidate next = candidate(c.u + step * du, c.v + step * dv, c.sheet);
          if (next.d2 >= c.d2) continue;
          c = next;
          moved = true;
        }
      }
    if (c.d2 < nearest.d2) nearest = c;
  }
  return s.world(s.point(nearest.u, nearest.v, nearest.sheet));
}

}  // namespace bisector::test
