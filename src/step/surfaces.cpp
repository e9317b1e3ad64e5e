#include "step/surfaces.h"

#include <GeomAPI_PointsToBSplineSurface.hxx>
#include <GeomConvert.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_BezierSurface.hxx>
#include <Geom_Circle.hxx>
#include <Geom_ConicalSurface.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_Ellipse.hxx>
#include <Geom_Hyperbola.hxx>
#include <Geom_Line.hxx>
#include <Geom_Parabola.hxx>
#include <Geom_Plane.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <Geom_SphericalSurface.hxx>
#include <Geom_SurfaceOfLinearExtrusion.hxx>
#include <Geom_SurfaceOfRevolution.hxx>
#include <Geom_ToroidalSurface.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <Precision.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <gp_Ax3.hxx>
#include <numbers>
#include <variant>

#include "segment/primitive.h"
#include "segment/quadric.h"
#include "segment/surface_normal.h"
#include "step/convert.h"

namespace bisector::step {
namespace {

constexpr double kMargin = 0.1;   // of their extent, that unbounded surfaces go beyond the border
constexpr int kPatchPoints = 32;  // on each side of a height field

Vec3 mean_of(const std::vector<Vec3>& points) {
  Vec3 sum;
  for (const Vec3& p : points) sum += p;
  return points.empty() ? sum : (1 / static_cast<double>(points.size())) * sum;
}

// The widest range of directions across an axis that the loops leave out.
struct Gap {
  double middle = 0, width = 2 * std::numbers::pi;  // radians, from the first of the axes across
};

Gap widest_gap(const std::vector<std::vector<Vec3>>& loops, const Vec3& centre, const Vec3& axis) {
  constexpr double kTurn = 2 * std::numbers::pi;
  const auto [u, v] = frame_across(axis);
  // Arcs from the lower to the higher direction, the start in [0, 2 pi).
  std::vector<std::array<double, 2>> arcs;
  for (const std::vector<Vec3>& loop : loops)
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vec3 p = loop[i] - centre, q = loop[(i + 1) % loop.size()] - centre;
      const double from = std::atan2(dot(p, v), dot(p, u));
      const double turn = std::remainder(std::atan2(dot(q, v), dot(q, u)) - from, kTurn);
      const double low = std::min(from, from + turn), start = low - kTurn * std::floor(low / kTurn);
      arcs.push_back({start, start + std::abs(turn)});
    }
  if (arcs.empty()) return {};
  std::sort(arcs.begin(), arcs.end());
  double reach = 0;
  for (const auto& [from, to] : arcs) reach = std::max(reach, to - kTurn);
  Gap gap{0, 0};
  arcs.push_back({arcs.front()[0] + kTurn, 0});
  reach = std::max(reach, arcs.front()[0]);
  for (const auto& [from, to] : arcs) {
    if (from - reach > gap.width) gap = {0.5 * (from + reach), from - reach};
    reach = std::max(reach, to);
  }
  return gap;
}

// A frame about an axis whose x direction, where seams lie, is away from the outline.
gp_Ax3 frame(const Vec3& centre, const Vec3& axis, const Outline& outline) {
  const double seam = widest_gap(outline.loops, centre, axis).middle;
  const auto [u, v] = frame_across(axis);
  return {point(centre), direction(axis), direction(std::cos(seam) * u + std::sin(seam) * v)};
}

Handle(Geom_Surface) surface_of(const Plane& s, const Outline& outline) {
  const Vec3 middle = mean_of(outline.points);
  return new Geom_Plane(point(middle - (dot(s.normal, middle) - s.offset) * s.normal), direction(s.normal));
}

// A piece with one loop that is smaller than a hemisphere has its poles and seam off it. Other pieces are about an axis
// through their loops.
Handle(Geom_Surface) surface_of(const Sphere& s, const Outline& outline) {
  Vec3 axis{0, 0, 1};
  if (outline.loops.size() == 1 && outline.area < 2 * std::numbers::pi * s.radius * s.radius) {
    const Vec3 middle = unit(mean_of(outline.points) - s.centre);
    if (norm2(middle) > 0) axis = perpendicular(middle);
  } else if (!outline.loops.empty()) {
    const Vec3 around = unit(twice_vector_area(outline.loops[0]));
    if (norm2(around) > 0) axis = around;
  }
  return new Geom_SphericalSurface(frame(s.centre, axis, outline), s.radius);
}

Handle(Geom_Surface) surface_of(const Cylinder& s, const Outline& outline) {
  const Vec3 at = s.point + dot(mean_of(outline.points) - s.point, s.axis) * s.axis;
  return new Geom_CylindricalSurface(frame(at, s.axis, outline), s.radius);
}

Handle(Geom_Surface) surface_of(const Cone& s, const Outline& outline) {
  const double height = std::max(0.0, dot(mean_of(outline.points) - s.apex, s.axis));
  return new Geom_ConicalSurface(frame(s.apex + height * s.axis, s.axis, outline), s.angle, height * std::tan(s.angle));
}

Handle(Geom_Surface) surface_of(const Torus& s, const Outline& outline) {
  return new Geom_ToroidalSurface(frame(s.centre, s.axis, outline), s.radius, s.minor_radius);
}

// Extent of points along an axis from a centre, with a margin.
struct Range {
  double low, high;
};
Range range_along(const std::vector<Vec3>& points, const Vec3& centre, const Vec3& axis) {
  Range range{1e300, -1e300};
  for (const Vec3& p : points) {
    const double t = dot(p - centre, axis);
    range = {std::min(range.low, t), std::max(range.high, t)};
  }
  const double margin = kMargin * (range.high - range.low);
  return {range.low - margin, range.high + margin};
}

// A quadric of revolution about z with unit lengths, made by turning a curve in the half-plane of `seam` and z, and
// stretched along the quadric's axes. On both sides of the seam an angle is left out.
Handle(Geom_Surface)
    stretched(const GeneralQuadric& q, const Handle(Geom_Curve) & profile, const Vec3& scale, double left_out) {
  Handle(Geom_Surface) turned = new Geom_SurfaceOfRevolution(profile, gp_Ax1());
  if (left_out > 0)
    turned = new Geom_RectangularTrimmedSurface(turned, left_out, 2 * std::numbers::pi - left_out, true);
  const Handle(Geom_BSplineSurface) spline = GeomConvert::SurfaceToBSplineSurface(turned);
  for (int i = 1; i <= spline->NbUPoles(); ++i)
    for (int j = 1; j <= spline->NbVPoles(); ++j) {
      const gp_Pnt p = spline->Pole(i, j);
      spline->SetPole(i, j,
                      point(q.centre + (scale.x * p.X()) * q.axes[0] + (scale.y * p.Y()) * q.axes[1] +
                            (scale.z * p.Z()) * q.axes[2]));
    }
  return Handle(Geom_Surface)(spline);
}

// Hyperbolic paraboloid x^2 / (2a) - y^2 / (2b) = z over a rectangle: one bilinear-by-degree-two patch.
Handle(Geom_Surface) saddle(const GeneralQuadric& q, const std::vector<Vec3>& border) {
  const Range x = range_along(border, q.centre, q.axes[0]), y = range_along(border, q.centre, q.axes[1]);
  const double xs[3] = {x.low, 0.5 * (x.low + x.high), x.high}, ys[3] = {y.low, 0.5 * (y.low + y.high), y.high};
  // Blossoms of the squares at the Bezier points.
  const double xx[3] = {x.low * x.low, x.low * x.high, x.high * x.high};
  const double yy[3] = {y.low * y.low, y.low * y.high, y.high * y.high};
  TColgp_Array2OfPnt poles(1, 3, 1, 3);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const double z = xx[i] / (2 * q.lengths[0]) - yy[j] / (2 * q.lengths[1]);
      poles(i + 1, j + 1) = point(q.centre + xs[i] * q.axes[0] + ys[j] * q.axes[1] + z * q.axes[2]);
    }
  return GeomConvert::SurfaceToBSplineSurface(new Geom_BezierSurface(poles));
}

Handle(Geom_Surface) surface_of(const GeneralQuadric& q, const Outline& outline) {
  const std::vector<Vec3>& border = outline.points;
  const auto [a, b, c] = q.lengths;
  const bool is_paraboloid = q.type == SurfaceType::elliptic_paraboloid;
  const Vec3 scale{is_paraboloid ? std::sqrt(a) : a, is_paraboloid ? std::sqrt(b) : b, c > 0 ? c : 1};
  // In the coordinates that `stretched` turns in, with the seam off the border.
  std::vector<std::vector<Vec3>> local;
  for (const std::vector<Vec3>& loop : outline.loops) {
    std::vector<Vec3>& scaled = local.emplace_back();
    for (const Vec3& p : loop)
      scaled.push_back({dot(p - q.centre, q.axes[0]) / scale.x, dot(p - q.centre, q.axes[1]) / scale.y, 0});
  }
  const Gap gap = widest_gap(local, {}, {0, 0, 1});
  const auto [first, second] = frame_across({0, 0, 1});
  const Vec3 seam = std::cos(gap.middle) * first + std::sin(gap.middle) * second;
  // A piece of an ellipsoid may be all but what its loop encloses; what is around a gap of others is not theirs.
  const double left_out = q.type == SurfaceType::ellipsoid ? 0 : (0.5 - kMargin) * gap.width;
  const gp_Dir x(seam.x, seam.y, 0), z(0, 0, 1);
  const Range heights = range_along(border, q.centre, q.axes[2]);
  const gp_Ax2 across(gp_Pnt(), x.Crossed(z), x);  // x and z are its axes
  switch (q.type) {
    case SurfaceType::ellipsoid: {
      const Handle(Geom_Circle) circle = new Geom_Circle(across, 1);
      return stretched(q, new Geom_TrimmedCurve(circle, -std::numbers::pi / 2, std::numbers::pi / 2), scale, left_out);
    }
    case SurfaceType::one_sheet_hyperboloid: {
      // x^2 - z^2 = 1: (cosh t, sinh t).
      const Handle(Geom_Hyperbola) curve = new Geom_Hyperbola(across, 1, 1);
      return stretched(q, new Geom_TrimmedCurve(curve, std::asinh(heights.low / c), std::asinh(heights.high / c)),
                       scale, left_out);
    }
    case SurfaceType::two_sheet_hyperboloid: {
      const bool is_upper = heights.low + heights.high > 0;
      const double farthest = std::max(1.0, (is_upper ? heights.high : -heights.low) / c);
      const Handle(Geom_Hyperbola) curve = new Geom_Hyperbola(
          gp_Ax2(gp_Pnt(), is_upper ? z.Crossed(x) : x.Crossed(z), is_upper ? z : z.Reversed()), 1, 1);
      return stretched(q, new Geom_TrimmedCurve(curve, 0, std::acosh(farthest) + kMargin), scale, left_out);
    }
    case SurfaceType::elliptic_cone: {
      const bool is_upper = heights.low + heights.high > 0;
      const double farthest = is_upper ? heights.high : -heights.low;
      const gp_Dir along(seam.x, seam.y, is_upper ? 1 : -1);
      const Handle(Geom_Line) line = new Geom_Line(gp_Pnt(), along);
      return stretched(q, new Geom_TrimmedCurve(line, 0, std::numbers::sqrt2 * farthest), scale, left_out);
    }
    case SurfaceType::elliptic_paraboloid: {
      // x^2 = 2 z with the focal length 1/2, and lengths that are radii of curvature.
      const Handle(Geom_Parabola) curve = new Geom_Parabola(gp_Ax2(gp_Pnt(), z.Crossed(x), z), 0.5);
      return stretched(q, new Geom_TrimmedCurve(curve, 0, std::sqrt(2 * std::max(heights.high, 0.0))), scale, left_out);
    }
    case SurfaceType::hyperbolic_paraboloid: return saddle(q, border);
    case SurfaceType::elliptic_cylinder: {
      const bool first_is_major = a >= b;
      const gp_Ax2 axes(point(q.centre), direction(q.axes[2]), direction(q.axes[first_is_major ? 0 : 1]));
      return new Geom_SurfaceOfLinearExtrusion(new Geom_Ellipse(axes, std::max(a, b), std::min(a, b)),
                                               direction(q.axes[2]));
    }
    case SurfaceType::hyperbolic_cylinder: {
      const bool is_right = dot(mean_of(border) - q.centre, q.axes[0]) > 0;
      const gp_Ax2 axes(point(q.centre), direction(q.axes[2]), direction(is_right ? q.axes[0] : -q.axes[0]));
      return new Geom_SurfaceOfLinearExtrusion(new Geom_Hyperbola(axes, a, b), direction(q.axes[2]));
    }
    case SurfaceType::parabolic_cylinder: {
      // x^2 / (2a) = z, rulings along y.
      const gp_Ax2 axes(point(q.centre), direction(q.axes[1]), direction(q.axes[2]));
      return new Geom_SurfaceOfLinearExtrusion(new Geom_Parabola(axes, a / 2), direction(q.axes[1]));
    }
    default: return {};
  }
}

// Whether the normal of what was made is opposite to the primitive's own.
bool is_flipped(const Handle(Geom_Surface) & made, const Primitive& surface) {
  double u0, u1, v0, v1;
  made->Bounds(u0, u1, v0, v1);
  const auto inside = [](double low, double high) {
    const bool has_low = !Precision::IsNegativeInfinite(low), has_high = !Precision::IsPositiveInfinite(high);
    return has_low && has_high ? 0.37 * low + 0.63 * high : has_low ? low + 1 : has_high ? high - 1 : 0.5;
  };
  gp_Pnt p;
  gp_Vec du, dv;
  made->D1(inside(u0, u1), inside(v0, v1), p, du, dv);
  const gp_Vec normal = du.Crossed(dv);
  const Vec3 own = surface_normal(surface, foot_point(surface, vector(p)));
  return dot({normal.X(), normal.Y(), normal.Z()}, own) < 0;
}

// Where the line p + t along meets the quadric with a gradient that rises along it, or falls if `falls`. Where it
// misses the quadric, the place where it is nearest to meeting it.
double height_on(const Quadric& q, const Vec3& p, const Vec3& along, bool falls) {
  const double c = value_of(q, p), b = dot(gradient_of(q, p), along);
  const double a = value_of(q, p + along) - c - b;
  const double root = (falls ? -1 : 1) * std::sqrt(std::max(0.0, b * b - 4 * a * c));
  // Two forms of the same root: one of them has no difference of like numbers.
  if (b * root > 0 || a == 0) return b + root != 0 ? -2 * c / (b + root) : 0;
  return (root - b) / (2 * a);
}

}  // namespace

Handle(Geom_Surface) make_patch(const GeneralQuadric& quadric, const Outline& outline, bool same_sense, bool& flipped) {
  const Vec3 facing = unit(twice_vector_area(outline.loops[0])), middle = mean_of(outline.points);
  const auto [u, v] = frame_across(facing);
  const Range x = range_along(outline.points, middle, u), y = range_along(outline.points, middle, v);
  TColgp_Array2OfPnt points(1, kPatchPoints, 1, kPatchPoints);
  for (int i = 0; i < kPatchPoints; ++i)
    for (int j = 0; j < kPatchPoints; ++j) {
      const double s = static_cast<double>(i) / (kPatchPoints - 1), t = static_cast<double>(j) / (kPatchPoints - 1);
      const Vec3 p = middle + (x.low + s * (x.high - x.low)) * u + (y.low + t * (y.high - y.low)) * v;
      points(i + 1, j + 1) = point(p + height_on(quadric.polynomial, p, facing, !same_sense) * facing);
    }
  GeomAPI_PointsToBSplineSurface made;
  made.Interpolate(points);
  flipped = is_flipped(made.Surface(), quadric);
  return Handle(Geom_Surface)(made.Surface());
}

Handle(Geom_Surface) make_surface(const Primitive& surface, const Outline& outline, bool& flipped) {
  const Handle(Geom_Surface) made = std::visit([&](const auto& s) { return surface_of(s, outline); }, surface);
  flipped = !made.IsNull() && is_flipped(made, surface);
  return made;
}

}  // namespace bisector::step
