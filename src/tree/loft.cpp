#include "tree/loft.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "bisector/error.h"
#include "tree/bspline.h"
#include "tree/frames.h"

namespace bisector {
namespace {

constexpr std::size_t kSides = 10;         // of the control polygons (thesis 3.4.2)
constexpr double kLeastRadius = 0.01;      // of the branch's largest
constexpr double kQuarter = 0.5522847498;  // of a circle's quadrant as a cubic: (4/3) tan(pi / 8)

// The axis: fitted the less closely, the more its bends narrow the branch.
constexpr std::array<double, 4> kLooser{0, 0.25, 0.5, 1};  // tolerances added, as shares of the radius
constexpr double kNarrowing =
    1.2;                       // ratio of the radius to what bends leave of it, at most, before a looser axis is tried
constexpr double kBend = 0.9;  // radius over the axis' radius of curvature, at most

// The wall's rows: as many as keep the error of its sections.
constexpr double kSectionError = 0.006;  // of the radius, in each direction across the axis
constexpr std::size_t kRefinements = 6;  // of the rows
constexpr std::size_t kMostRows = 200;   // before the last refinement
constexpr int kChecks = 4;               // places looked at in each knot interval

// The radius is lowered where the wall folds over.
constexpr double kShrinking = 0.8;  // ratio of one step
constexpr int kShrinkings = 12;     // steps

// The mesh.
constexpr int kChordHalvings = 8;                 // of a knot interval, at most
constexpr int kFewestSides = 6, kMostSides = 48;  // of a ring

struct SurfacePoint {
  Vec3 position, in_u, in_v;
};

SurfacePoint evaluate(const BranchSurface& s, double u, double v) {
  const BasisFunctions along = basis_functions(s.knots_u, 3, u),
                       around = basis_functions(s.knots_v, 3, v - std::floor(v));
  SurfacePoint result;
  for (std::size_t i = 0; i < 4; ++i) {
    Vec3 row, row_in_v;
    for (std::size_t j = 0; j < 4; ++j) {
      const Vec3& c = s.control[(along.first + i) * s.columns + around.first + j];
      row += around.values[j] * c;
      row_in_v += around.derivatives[j] * c;
    }
    result.position += along.values[i] * row;
    result.in_u += along.derivatives[i] * row;
    result.in_v += along.values[i] * row_in_v;
  }
  return result;
}

std::vector<double> distinct(const std::vector<double>& knots) {
  std::vector<double> result = knots;
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

// kChecks parameters from each knot on, and the last knot.
std::vector<double> check_parameters(const std::vector<double>& knots) {
  std::vector<double> result;
  for (std::size_t i = 1; i < knots.size(); ++i)
    for (int k = 0; k < kChecks; ++k) result.push_back(knots[i - 1] + (knots[i] - knots[i - 1]) * k / kChecks);
  result.push_back(knots.back());
  return result;
}

double table_at(const std::vector<double>& parameters, const std::vector<double>& values, double t) {
  const auto above = std::upper_bound(parameters.begin(), parameters.end(), t);
  if (above == parameters.begin()) return values.front();
  if (above == parameters.end()) return values.back();
  const auto i = static_cast<std::size_t>(above - parameters.begin());
  const double share = (t - parameters[i - 1]) / (parameters[i] - parameters[i - 1]);
  return (1 - share) * values[i - 1] + share * values[i];
}

void check_radii(const std::vector<Vec3>& points, const std::vector<double>& radii) {
  if (points.size() != radii.size())
    throw Error(fmt::format("branch: {} radii for {} points; give one each", radii.size(), points.size()));
  double largest = 0;
  for (std::size_t i = 0; i < radii.size(); ++i) {
    if (!(radii[i] >= 0) || !std::isfinite(radii[i]))
      throw Error(fmt::format("branch: radius {} of point {}; give a length, 0 or more", radii[i], i));
    largest = std::max(largest, radii[i]);
  }
  if (!(largest > 0)) throw Error("branch: all radii are 0; give a positive one");
}

// Table of the radius over the axis with an entry wherever the bend is looked at.
void tabulate_radius(BranchSurface& s) {
  std::vector<double> t = check_parameters(distinct(s.axis.knots));
  t.insert(t.end(), s.radius_parameters.begin(), s.radius_parameters.end());
  std::sort(t.begin(), t.end());
  t.erase(std::unique(t.begin(), t.end()), t.end());
  std::vector<double> r(t.size());
  for (std::size_t i = 0; i < t.size(); ++i) r[i] = s.radius(t[i]);
  s.radius_parameters = std::move(t);
  s.radii = std::move(r);
}

// Lowers the table to `limits`, one for each entry and infinite where there is none, with slopes of 45 degrees beside
// them. False if nothing changed.
bool limit_radius(BranchSurface& s, std::vector<double> limits) {
  const double least = kLeastRadius * *std::max_element(s.radii.begin(), s.radii.end());
  const std::size_t n = s.radii.size();
  std::vector<Vec3> places(n);
  for (std::size_t i = 0; i < n; ++i) places[i] = s.axis.point(s.radius_parameters[i]);
  for (std::size_t i = 1; i < n; ++i) limits[i] = std::min(limits[i], limits[i - 1] + norm(places[i] - places[i - 1]));
  for (std::size_t i = n - 1; i > 0; --i)
    limits[i - 1] = std::min(limits[i - 1], limits[i] + norm(places[i] - places[i - 1]));
  bool changed = false;
  for (std::size_t i = 0; i < n; ++i)
    if (const double limit = std::max(limits[i], least); limit < s.radii[i]) {
      s.radii[i] = limit;
      changed = true;
    }
  return changed;
}

// No wall is wider than its axis' bends let it be. Returns the largest ratio of a radius to what is left of it.
double limit_by_curvature(BranchSurface& s) {
  BranchSurface limited = s;
  tabulate_radius(limited);
  const std::vector<double> radii = limited.radii;
  std::vector<double> limits(radii.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const double t = limited.radius_parameters[i];
    const Vec3 first = s.axis.derivative(t), second = s.axis.second_derivative(t);
    const double speed = norm(first), bend = norm(cross(first, second));
    if (kBend * speed * speed * speed < radii[i] * bend) limits[i] = kBend * speed * speed * speed / bend;
  }
  if (!limit_radius(limited, limits)) return 1;
  s = limited;
  double largest = 1;
  for (std::size_t i = 0; i < radii.size(); ++i) largest = std::max(largest, radii[i] / s.radii[i]);
  return largest;
}

// The axis through the points, as near as `tolerance`, or as kLooser allow where it would bend too sharply for the
// radii.
BranchSurface fit_axis(const std::vector<Vec3>& points, const std::vector<double>& radii, double tolerance,
                       std::size_t max_control) {
  BranchSurface best;
  double least = std::numeric_limits<double>::infinity();
  for (const double share : kLooser) {
    std::vector<double> tolerances(points.size(), tolerance);
    for (std::size_t i = 0; i < points.size(); ++i) tolerances[i] = std::max(tolerance, share * radii[i]);
    const CurveFit fit = fit_curve(points, tolerances, max_control);
    BranchSurface surface{as_cubic(fit.curve), fit.parameters, radii, 0, 0, {}, {}, {}};
    const double lost = limit_by_curvature(surface);
    if (lost < least) {
      least = lost;
      best = std::move(surface);
    }
    if (least <= kNarrowing) break;
  }
  return best;
}

// A section's two half-axes, the control polygon's scale left out.
struct Section {
  Vec3 normal, binormal;
};

std::vector<Section> sections(const BranchSurface& s, const BSplineCurve& axis, const std::vector<double>& parameters) {
  std::vector<Section> result;
  for (const Frame& f : rotation_minimising_frames(axis, parameters)) {
    const double radius = s.radius(parameters[result.size()]);
    result.push_back({radius * f.normal, radius * f.binormal});
  }
  return result;
}

// The parameter that each control point of a cubic stands at.
std::vector<double> greville(const BSplineCurve& cubic) {
  std::vector<double> t(cubic.control.size());
  for (std::size_t i = 0; i < t.size(); ++i)
    t[i] = std::clamp((cubic.knots[i + 1] + cubic.knots[i + 2] + cubic.knots[i + 3]) / 3, i ? t[i - 1] : 0.0, 1.0);
  return t;
}

// Control points of the sections that take their values at the Greville parameters.
std::vector<Section> control_sections(const BranchSurface& s, const BSplineCurve& axis) {
  const std::vector<double> t = greville(axis);
  const std::vector<Section> values = sections(s, axis, t);
  const auto n = static_cast<Eigen::Index>(t.size());
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(n, n), right(n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i);
    const BasisFunctions functions = basis_functions(axis.knots, 3, t[row]);
    for (std::size_t k = 0; k < 4; ++k) basis(i, static_cast<Eigen::Index>(functions.first + k)) = functions.values[k];
    for (int k = 0; k < 3; ++k) {
      right(i, k) = values[row].normal[k];
      right(i, 3 + k) = values[row].binormal[k];
    }
  }
  const Eigen::MatrixXd solution = basis.partialPivLu().solve(right);
  std::vector<Section> control(t.size());
  for (Eigen::Index i = 0; i < n; ++i)
    control[static_cast<std::size_t>(i)] = {{solution(i, 0), solution(i, 1), solution(i, 2)},
                                            {solution(i, 3), solution(i, 4), solution(i, 5)}};
  control.front() = values.front();
  control.back() = values.back();
  return control;
}

// Middles of the knot intervals on which B-splines over the control points' sections are off the sections there.
std::vector<double> missing_knots(const BranchSurface& s, const BSplineCurve& axis, const std::vector<Section>& rows) {
  const std::vector<double> knots = distinct(axis.knots), t = check_parameters(knots);
  const std::vector<Section> exact = sections(s, axis, t);
  std::vector<double> missing;
  for (std::size_t i = 0; i + 1 < t.size(); ++i) {
    const BasisFunctions basis = basis_functions(axis.knots, 3, t[i]);
    Section off{-exact[i].normal, -exact[i].binormal};
    for (std::size_t k = 0; k < 4; ++k) {
      off.normal += basis.values[k] * rows[basis.first + k].normal;
      off.binormal += basis.values[k] * rows[basis.first + k].binormal;
    }
    const double allowed = kSectionError * s.radius(t[i]);
    const std::size_t span = i / kChecks;
    // A knot itself shows the error of both its sides.
    for (const std::size_t at : {span, i % kChecks == 0 && span > 0 ? span - 1 : span})
      if (norm(off.normal) > allowed || norm(off.binormal) > allowed)
        missing.push_back(0.5 * (knots[at] + knots[at + 1]));
  }
  std::sort(missing.begin(), missing.end());
  missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
  return missing;
}

// Scale of a regular control polygon whose periodic cubic B-spline is nearest to the unit circle: between the knots'
// and the middles' distances from the centre.
double polygon_scale() {
  const double angle = 2 * std::numbers::pi / kSides;
  const double at_knots = (4 + 2 * std::cos(angle)) / 6;
  const double at_middles = (46 * std::cos(0.5 * angle) + 2 * std::cos(1.5 * angle)) / 48;
  return 2 / (at_knots + at_middles);
}

void add_row(BranchSurface& s, const Vec3& centre, const Section& section, double scale) {
  const double polygon = scale * polygon_scale();
  for (std::size_t j = 0; j < s.columns; ++j) {
    // At v = 0 the second control point weighs most. Clockwise about the tangent, so that the normal is outwards.
    const double angle = 2 * std::numbers::pi * (static_cast<double>(j % kSides) - 1) / kSides;
    s.control.push_back(centre + polygon * (std::cos(angle) * section.normal - std::sin(angle) * section.binormal));
  }
}

// Base, wall and tip over the axis, which is refined until the sections fit.
void build_surface(BranchSurface& s) {
  BSplineCurve axis = s.axis;
  std::vector<Section> rows = control_sections(s, axis);
  for (std::size_t pass = 0; pass < kRefinements && axis.control.size() < kMostRows; ++pass) {
    const std::vector<double> missing = missing_knots(s, axis, rows);
    if (missing.empty()) break;
    for (const double t : missing) axis = insert_knot(axis, t);
    rows = control_sections(s, axis);
  }

  s.columns = kSides + 3;
  s.control.clear();
  for (int i = 0; i < 3; ++i) add_row(s, axis.control.front(), rows.front(), i / 3.0);
  for (std::size_t i = 0; i < rows.size(); ++i) add_row(s, axis.control[i], rows[i], 1);
  const Vec3 tip = cross(rows.back().normal, rows.back().binormal);
  const Vec3 height = s.radii.back() / norm(tip) * tip;
  add_row(s, axis.control.back() + kQuarter * height, rows.back(), 1);
  add_row(s, axis.control.back() + height, rows.back(), kQuarter);
  add_row(s, axis.control.back() + height, rows.back(), 0);
  s.rows = rows.size() + 6;

  s.knots_u.assign(4, -1.0);
  s.knots_u.insert(s.knots_u.end(), axis.knots.begin() + 1, axis.knots.end() - 1);
  s.knots_u.insert(s.knots_u.end(), 4, 2.0);
  s.knots_v.clear();
  for (int j = -3; j <= static_cast<int>(kSides) + 3; ++j) s.knots_v.push_back(static_cast<double>(j) / kSides);
}

// Axis parameters where the wall's normal points inwards.
std::vector<double> folds(const BranchSurface& s) {
  std::vector<double> knots = distinct(s.knots_u), result;
  knots.erase(knots.begin());
  knots.pop_back();
  for (const double u : check_parameters(knots)) {
    const Vec3 centre = s.axis.point(u);
    for (std::size_t j = 0; j < kSides; ++j) {
      const SurfacePoint p = evaluate(s, u, static_cast<double>(j) / kSides);
      if (dot(cross(p.in_u, p.in_v), p.position - centre) > 0) continue;
      result.push_back(u);
      break;
    }
  }
  return result;
}

// Lowers the radius on both sides of each parameter. False if it is at its least everywhere there.
bool shrink_at(BranchSurface& s, const std::vector<double>& parameters) {
  tabulate_radius(s);
  std::vector<double> limits(s.radii.size(), std::numeric_limits<double>::infinity());
  for (const double t : parameters) {
    const auto above = std::lower_bound(s.radius_parameters.begin(), s.radius_parameters.end(), t);
    const auto i = std::min(static_cast<std::size_t>(above - s.radius_parameters.begin()), limits.size() - 1);
    for (const std::size_t k : {i > 0 ? i - 1 : i, i}) limits[k] = kShrinking * s.radii[k];
  }
  return limit_radius(s, limits);
}

// Halves [a, b] until the surface is within `tolerance` of its chords, and adds the parameters after a up to b.
void add_stations(const BranchSurface& s, double a, double b, double tolerance, int halvings,
                  std::vector<double>& stations) {
  double error = 0;
  for (std::size_t j = 0; j < kSides; ++j) {
    const double v = static_cast<double>(j) / kSides;
    const Vec3 from = s.point(a, v), to = s.point(b, v);
    for (const double x : {0.25, 0.5, 0.75}) {
      const Vec3 p = s.point(a + x * (b - a), v);
      error = std::max(error, norm((p - from) - nearest_parameter(p, from, to) * (to - from)));
    }
  }
  if (error <= tolerance || halvings == 0) {
    stations.push_back(b);
    return;
  }
  const double middle = 0.5 * (a + b);
  add_stations(s, a, middle, tolerance, halvings - 1, stations);
  add_stations(s, middle, b, tolerance, halvings - 1, stations);
}

int sides_for(const BranchSurface& s, double tolerance) {
  const double largest = *std::max_element(s.radii.begin(), s.radii.end());
  if (tolerance >= largest) return kFewestSides;
  return static_cast<int>(std::clamp(std::ceil(std::numbers::pi / std::acos(1 - tolerance / largest)),
                                     double{kFewestSides}, double{kMostSides}));
}

}  // namespace

Vec3 BranchSurface::point(double u, double v) const { return evaluate(*this, u, v).position; }

double BranchSurface::radius(double t) const { return table_at(radius_parameters, radii, t); }

BranchSurface loft_branch(const std::vector<Vec3>& points, const std::vector<double>& radii, double tolerance,
                          std::size_t max_control) {
  check_radii(points, radii);
  std::vector<double> positive = radii;
  const double least = kLeastRadius * *std::max_element(radii.begin(), radii.end());
  for (double& r : positive) r = std::max(r, least);

  BranchSurface surface = fit_axis(points, positive, tolerance, max_control);
  build_surface(surface);
  for (int k = 0; k < kShrinkings; ++k) {
    const std::vector<double> folded = folds(surface);
    if (folded.empty() || !shrink_at(surface, folded)) break;
    build_surface(surface);
  }
  return surface;
}

TriangleMesh branch_mesh(const BranchSurface& surface, double tolerance, int sides) {
  if (!(tolerance > 0)) throw Error(fmt::format("branch mesh: tolerance {}; give a positive length", tolerance));
  if (sides == 0) sides = sides_for(surface, tolerance);
  if (sides < 3) throw Error(fmt::format("branch mesh: {} sides; give 3 or more", sides));
  const std::vector<double> knots = distinct(surface.knots_u);
  std::vector<double> stations{0};
  for (std::size_t i = 2; i < knots.size(); ++i)
    add_stations(surface, knots[i - 1], knots[i], tolerance, kChordHalvings, stations);
  stations.pop_back();  // the tip's point

  TriangleMesh mesh;
  for (const double u : stations)
    for (int j = 0; j < sides; ++j) mesh.vertices.push_back(surface.point(u, static_cast<double>(j) / sides));
  const auto base = static_cast<Index>(mesh.vertices.size()), tip = base + 1;
  mesh.vertices.push_back(surface.point(-1, 0));
  mesh.vertices.push_back(surface.point(2, 0));

  const auto around = static_cast<Index>(sides);
  const auto vertex = [&](std::size_t ring, Index j) { return static_cast<Index>(ring) * around + j % around; };
  for (Index j = 0; j < around; ++j) mesh.triangles.push_back({base, vertex(0, j), vertex(0, j + 1)});
  for (std::size_t i = 0; i + 1 < stations.size(); ++i)
    for (Index j = 0; j < around; ++j) {
      const Index a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1), d = vertex(i, j + 1);
      if (norm2(mesh.vertices[a] - mesh.vertices[c]) <= norm2(mesh.vertices[b] - mesh.vertices[d])) {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
      } else {
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({b, c, d});
      }
    }
  for (Index j = 0; j < around; ++j)
    mesh.triangles.push_back({vertex(stations.size() - 1, j), tip, vertex(stations.size() - 1, j + 1)});
  return mesh;
}

}  // namespace bisector
