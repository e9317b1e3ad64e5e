#include "segment/primitive.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>

#include "bisector/error.h"

namespace bisector {
namespace {

using Axes = std::array<Vec3, 3>;

constexpr double kRounding = 1e-9;        // of the extent: what differs by less is the same
constexpr double kZeroCurvature = 1e-15;  // of the greatest eigenvalue: what is less is 0

Vec3 require_direction(const Vec3& v, const char* what) {
  const double length = norm(v);
  if (!(length > 0) || !std::isfinite(length))
    throw Error(std::string(what) + " is no direction: give a finite vector other than 0");
  return (1 / length) * v;
}

void require_length(double length, const char* what) {
  if (!(length > 0) || !std::isfinite(length))
    throw Error(std::string(what) + " is not positive: give a finite length");
}

// Cylindrical coordinates of a point about an axis; `outward` is a unit vector, any one for points of the axis.
struct Cylindrical {
  Vec3 outward;
  double rho, z;
};

Cylindrical cylindrical(const Vec3& centre, const Vec3& axis, const Vec3& p) {
  const Vec3 q = p - centre;
  const double z = dot(axis, q);
  const Vec3 across = q - z * axis;
  const double rho = norm(across);
  if (!(rho > 0)) return {frame_across(axis).first, rho, z};
  // Near the axis rounding leaves something along it.
  Vec3 outward = (1 / rho) * across;
  outward -= dot(outward, axis) * axis;
  const double length = norm(outward);
  return {length > 0.5 ? (1 / length) * outward : frame_across(axis).first, rho, z};
}

// Quadrics with an apex or a line where their gradient is 0; their lengths are ratios.
bool meets_itself(const GeneralQuadric& quadric) {
  return quadric.type == SurfaceType::elliptic_cone ||
         (quadric.type == SurfaceType::plane_pair && quadric.lengths[1] > 0);
}

// v' A v for the matrix A of the second-degree terms.
double curvature(const Quadric& q, const Vec3& v) {
  return v.x * (q.c[4] * v.x + q.c[5] * v.y + q.c[6] * v.z) + v.y * (q.c[7] * v.y + q.c[8] * v.z) + q.c[9] * v.z * v.z;
}

Axes principal_axes(const Quadric& q) {
  Eigen::Matrix3d a;
  a << q.c[4], q.c[5] / 2, q.c[6] / 2, q.c[5] / 2, q.c[7], q.c[8] / 2, q.c[6] / 2, q.c[8] / 2, q.c[9];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(a);
  Axes axes;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d v = solver.eigenvectors().col(k);
    axes[static_cast<std::size_t>(k)] = {v[0], v[1], v[2]};
  }
  return axes;
}

// The points y(s) = -(1 - s) g / (2 rho E(s)), E = e + s (1 - e), 0 <= s <= 1, about p in principal axes, where
// c + g y + lambda y^2 falls from c > 0 at s = 1. They are the stationary points of |y|^2 for those multipliers that
// can belong to the nearest point of the quadric: 1 + 2 mu lambda >= 0 (Moré 1993, "Generalizations of the trust region
// problem"). So of the six roots of Fitzgibbon's polynomial only one has to be found, by bracketing.
struct NearestPointPath {
  double c = 0, rho = 0;
  bool indefinite = false;  // some lambda < 0: mu is bounded, and at s = 0 y may move freely where e = 0
  std::array<double, 3> g{}, lambda{}, e{}, y{};
  double value = 0, slope = 0;  // of the polynomial at y, and its derivative by s

  // s and w = 1 - s are both given so that the small one is exact.
  void move_to(double s, double w) {
    value = c;
    slope = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double denominator = s < w ? e[k] + s * (1 - e[k]) : 1 - w * (1 - e[k]);
      y[k] = 0;
      if (g[k] == 0) continue;
      y[k] = -w * g[k] / (2 * rho * denominator);
      value += y[k] * (g[k] + lambda[k] * y[k]);
      slope += g[k] * g[k] / (2 * rho * denominator * denominator * denominator);
    }
    if (!indefinite) slope *= s;
  }
};

// The root of the path's value in 0 < v <= 1/2, where v is s or w, by Newton steps within a bracket.
void find_root(NearestPointPath& path, bool v_is_s, double start) {
  double low = 0, high = 0.5, v = start;
  for (int i = 0; i < 200; ++i) {
    v_is_s ? path.move_to(v, 1 - v) : path.move_to(1 - v, v);
    if (std::abs(path.value) <= 2 * std::numeric_limits<double>::epsilon() * path.c) return;
    ((path.value > 0) == v_is_s ? high : low) = v;
    double next = v + (v_is_s ? -path.value : path.value) / path.slope;
    if (!(next > low && next < high) || i % 4 == 3) next = low > 0 ? std::sqrt(low) * std::sqrt(high) : high / 16;
    if (std::abs(next - v) <= std::numeric_limits<double>::epsilon() * v || next == low || next == high) return;
    v = next;
  }
}

// The quadric's nearest point to p, or none if it has no real one.
std::optional<Vec3> nearest_point(const Quadric& q, const Axes& axes, const Vec3& p) {
  NearestPointPath path;
  const double value = value_of(q, p), sign = value < 0 ? -1 : 1;
  if (value == 0) return p;
  path.c = std::abs(value);
  const Vec3 gradient = gradient_of(q, p);
  double greatest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    path.g[k] = sign * dot(axes[k], gradient);
    path.lambda[k] = sign * curvature(q, axes[k]);
    greatest = std::max(greatest, std::abs(path.lambda[k]));
  }
  for (double& l : path.lambda)
    if (std::abs(l) < kZeroCurvature * greatest) l = 0;

  const std::size_t least =
      static_cast<std::size_t>(std::min_element(path.lambda.begin(), path.lambda.end()) - path.lambda.begin());
  Vec3 foot = p;
  if (greatest == 0) {
    if (!(norm2(gradient) > 0)) return std::nullopt;
    foot -= (value / norm2(gradient)) * gradient;
  } else {
    path.indefinite = path.lambda[least] < 0;
    path.rho = path.indefinite ? -path.lambda[least] : greatest;
    for (std::size_t k = 0; k < 3; ++k)
      path.e[k] = path.indefinite ? (path.lambda[k] - path.lambda[least]) / path.rho : path.lambda[k] / greatest;

    path.move_to(0.5, 0.5);
    if (path.value <= 0) {
      const double w = 2 * path.rho * path.c / norm2(gradient);
      find_root(path, false, std::min(0.5, path.indefinite ? w : w / (1 + w)));
    } else {
      path.move_to(0, 1);
      if (path.value > 0) {
        if (path.indefinite) path.y[least] += std::sqrt(path.value / path.rho);
        else if (path.value > 1e-12 * path.c) return std::nullopt;
      } else {
        find_root(path, true, 0.25);
      }
    }
    for (std::size_t k = 0; k < 3; ++k) foot += path.y[k] * axes[k];
  }

  // What rounding has left of the value, along the gradient.
  for (int i = 0; i < 3; ++i) {
    const double left = value_of(q, foot);
    const Vec3 down = gradient_of(q, foot);
    const Vec3 next = foot - (left / norm2(down)) * down;
    if (!(std::abs(value_of(q, next)) < std::abs(left))) break;
    foot = next;
  }
  return foot;
}

// f = sum of lambda_k z_k^2 + b_k z_k, + c, in coordinates z along axes.
struct PrincipalForm {
  Axes axes;
  std::array<double, 3> lambda, b;
  double c;

  Quadric quadric() const {
    Quadric q;
    q.c[0] = c;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& a = axes[k];
      for (int i = 0; i < 3; ++i) q.c[static_cast<std::size_t>(i) + 1] += b[k] * a[i];
      const double l = lambda[k];
      q.c[4] += l * a.x * a.x;
      q.c[5] += 2 * l * a.x * a.y;
      q.c[6] += 2 * l * a.x * a.z;
      q.c[7] += l * a.y * a.y;
      q.c[8] += 2 * l * a.y * a.z;
      q.c[9] += l * a.z * a.z;
    }
    return q;
  }
  // Where the derivative along axis k is 0; for lambda_k other than 0.
  double middle(std::size_t k) const { return -b[k] / (2 * lambda[k]); }
  // c once the squares of the first n axes are completed.
  double rest(std::size_t n) const {
    double r = c;
    for (std::size_t k = 0; k < n; ++k) r -= b[k] * b[k] / (4 * lambda[k]);
    return r;
  }
  Vec3 point(double z0, double z1, double z2) const { return z0 * axes[0] + z1 * axes[1] + z2 * axes[2]; }
};

// With the greatest |lambda| first.
PrincipalForm principal_form(const Quadric& q) {
  PrincipalForm form;
  const Axes axes = principal_axes(q);
  std::array<std::size_t, 3> order{0, 1, 2};
  std::array<double, 3> lambda;
  for (std::size_t k = 0; k < 3; ++k) lambda[k] = curvature(q, axes[k]);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return std::abs(lambda[i]) > std::abs(lambda[j]); });
  for (std::size_t k = 0; k < 3; ++k) {
    form.axes[k] = axes[order[k]];
    form.lambda[k] = lambda[order[k]];
    form.b[k] = dot(axes[order[k]], Vec3{q.c[1], q.c[2], q.c[3]});
  }
  form.c = q.c[0];
  return form;
}

PrincipalForm permuted(const PrincipalForm& form, const std::array<std::size_t, 3>& order) {
  PrincipalForm result = form;
  for (std::size_t k = 0; k < 3; ++k) {
    result.axes[k] = form.axes[order[k]];
    result.lambda[k] = form.lambda[order[k]];
    result.b[k] = form.b[order[k]];
  }
  return result;
}

using Points = std::vector<Vec3>;

// Points of the surface in the unit ball, or nearest to it if none are in it: those nearest to the points of a grid.
Points surface_points(const Quadric& q, const Axes& axes) {
  constexpr int kSteps = 3;
  Points inside, all;
  for (int i = -kSteps; i <= kSteps; ++i)
    for (int j = -kSteps; j <= kSteps; ++j)
      for (int k = -kSteps; k <= kSteps; ++k) {
        const Vec3 p = (1.0 / kSteps) * Vec3{1.0 * i, 1.0 * j, 1.0 * k};
        if (norm2(p) > 1.0 + kRounding) continue;
        const std::optional<Vec3> foot = nearest_point(q, axes, p);
        if (!foot || !std::isfinite(norm2(*foot))) continue;
        (norm2(*foot) <= 1.0 ? inside : all).push_back(*foot);
      }
  return inside.empty() ? all : inside;
}

bool close(const Primitive& candidate, const Points& points, double slack) {
  const bool general = std::holds_alternative<GeneralQuadric>(candidate);
  return std::all_of(points.begin(), points.end(), [&](const Vec3& p) {
    return (general ? norm(foot_point(candidate, p) - p) : distance(candidate, p)) <= slack;
  });
}

// The form with lambda_k z_k^2 replaced by its best linear function on the points.
PrincipalForm straightened(PrincipalForm form, std::size_t k, const Points& points) {
  const double n = static_cast<double>(points.size());
  double m1 = 0, m2 = 0, m3 = 0;
  for (const Vec3& p : points) {
    const double z = dot(form.axes[k], p);
    m1 += z / n;
    m2 += z * z / n;
    m3 += z * z * z / n;
  }
  const double variance = m2 - m1 * m1;
  const double slope = variance > kRounding ? (m3 - m1 * m2) / variance : 0;
  form.b[k] += form.lambda[k] * slope;
  form.c += form.lambda[k] * (m2 - slope * m1);
  form.lambda[k] = 0;
  return form;
}

// The form with b_k z_k replaced by its mean on the points.
PrincipalForm levelled(PrincipalForm form, std::size_t k, const Points& points) {
  double mean = 0;
  for (const Vec3& p : points) mean += dot(form.axes[k], p) / static_cast<double>(points.size());
  form.c += form.b[k] * mean;
  form.b[k] = 0;
  return form;
}

GeneralQuadric general(SurfaceType type, const PrincipalForm& form, const Vec3& centre,
                       const std::array<double, 3>& lengths) {
  return {type, form.quadric(), centre, form.axes, lengths};
}

std::optional<Primitive> as_plane(const Points& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Vec3& p : points) mean += Eigen::Vector3d(p.x, p.y, p.z) / static_cast<double>(points.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Vec3& p : points) {
    const Eigen::Vector3d d = Eigen::Vector3d(p.x, p.y, p.z) - mean;
    covariance += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const Eigen::Vector3d n = solver.eigenvectors().col(0);
  if (!(solver.eigenvalues()[1] > kRounding * kRounding)) return std::nullopt;
  return make_plane({n[0], n[1], n[2]}, n.dot(mean));
}

std::optional<Primitive> as_sphere(PrincipalForm form) {
  const double mean = (form.lambda[0] + form.lambda[1] + form.lambda[2]) / 3;
  form.lambda = {mean, mean, mean};
  const double radius2 = mean != 0 ? -form.rest(3) / mean : 0;
  if (!(radius2 > 0) || !std::isfinite(radius2)) return std::nullopt;
  return make_sphere(form.point(form.middle(0), form.middle(1), form.middle(2)), std::sqrt(radius2));
}

std::optional<Primitive> as_cylinder(PrincipalForm form) {
  const double mean = (form.lambda[0] + form.lambda[1]) / 2;
  if (!(form.lambda[0] * form.lambda[1] > 0)) return std::nullopt;
  form.lambda[0] = form.lambda[1] = mean;
  const double radius2 = -form.rest(2) / mean;
  if (!(radius2 > 0) || !std::isfinite(radius2)) return std::nullopt;
  return make_cylinder(form.point(form.middle(0), form.middle(1), 0), form.axes[2], std::sqrt(radius2));
}

// The axis of the eigenvalue whose sign is that of no other last, before it the longer one first; none if all signs
// agree.
std::optional<PrincipalForm> odd_sign_last(const PrincipalForm& form) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = k == 0 ? 1 : 0, j = k == 2 ? 1 : 2;
    if (form.lambda[i] * form.lambda[k] < 0 && form.lambda[j] * form.lambda[k] < 0) return permuted(form, {j, i, k});
  }
  return std::nullopt;
}

std::optional<Primitive> as_cone(const PrincipalForm& form) {
  std::optional<PrincipalForm> odd = odd_sign_last(form);
  if (!odd) return std::nullopt;
  const double mean = (odd->lambda[0] + odd->lambda[1]) / 2;
  const Vec3 apex = odd->point(odd->middle(0), odd->middle(1), odd->middle(2));
  if (!std::isfinite(norm2(apex))) return std::nullopt;
  const Vec3 axis = dot(odd->axes[2], apex) > 0 ? -odd->axes[2] : odd->axes[2];
  // Eigenvalues of very different size give an angle that rounds to that of a line or of a plane.
  const double angle = std::atan(std::sqrt(-odd->lambda[2] / mean));
  if (!(angle > 0 && angle < std::acos(0.0))) return std::nullopt;
  return make_cone(apex, axis, angle);
}

std::optional<Primitive> as_parallel_planes(const PrincipalForm& form) {
  const double half2 = -form.rest(1) / form.lambda[0];
  if (!(half2 > 0)) return std::nullopt;
  return general(SurfaceType::plane_pair, form, form.point(form.middle(0), 0, 0), {std::sqrt(half2), 0, 0});
}

std::optional<Primitive> as_crossing_planes(PrincipalForm form) {
  if (!(form.lambda[0] * form.lambda[1] < 0)) return std::nullopt;
  form.c -= form.rest(2);
  const PrincipalForm f = permuted(form, {1, 0, 2});
  const double a = std::sqrt(std::abs(f.lambda[1])), b = std::sqrt(std::abs(f.lambda[0])), length = std::hypot(a, b);
  return general(SurfaceType::plane_pair, f, f.point(f.middle(0), f.middle(1), 0), {a / length, b / length, 0});
}

std::optional<Primitive> as_parabolic_cylinder(const PrincipalForm& form) {
  const Vec3 linear = form.b[1] * form.axes[1] + form.b[2] * form.axes[2];
  const double slope = norm(linear);
  if (!(slope > 0)) return std::nullopt;
  PrincipalForm turned = form;
  turned.axes[2] = (form.lambda[0] > 0 ? -1 / slope : 1 / slope) * linear;
  turned.axes[1] = cross(turned.axes[2], turned.axes[0]);
  turned.b[1] = 0;
  turned.b[2] = form.lambda[0] > 0 ? -slope : slope;
  const Vec3 vertex = turned.point(turned.middle(0), 0, -turned.rest(1) / turned.b[2]);
  return general(SurfaceType::parabolic_cylinder, turned, vertex, {slope / (2 * std::abs(form.lambda[0])), 0, 0});
}

// Of rank two, without a linear term along the third axis.
std::optional<Primitive> as_general_cylinder(const PrincipalForm& form) {
  const double rest = form.rest(2);
  if (form.lambda[0] == 0 || form.lambda[1] == 0 || rest == 0) return std::nullopt;
  const bool elliptic = form.lambda[0] * form.lambda[1] > 0;
  if (elliptic && form.lambda[0] * rest > 0) return std::nullopt;
  // The axis that meets a hyperbolic cylinder, or the longer one of an elliptic cylinder, first.
  const bool swap = elliptic || form.lambda[0] * rest > 0;
  const PrincipalForm f = swap ? permuted(form, {1, 0, 2}) : form;
  return general(elliptic ? SurfaceType::elliptic_cylinder : SurfaceType::hyperbolic_cylinder, f,
                 f.point(f.middle(0), f.middle(1), 0),
                 {std::sqrt(std::abs(rest / f.lambda[0])), std::sqrt(std::abs(rest / f.lambda[1])), 0});
}

std::optional<Primitive> as_elliptic_cone(const PrincipalForm& form) {
  std::optional<PrincipalForm> f = odd_sign_last(form);
  if (!f) return std::nullopt;
  f->c -= f->rest(3);
  const Vec3 apex = f->point(f->middle(0), f->middle(1), f->middle(2));
  return general(SurfaceType::elliptic_cone, *f, apex,
                 {std::sqrt(-f->lambda[2] / f->lambda[0]), std::sqrt(-f->lambda[2] / f->lambda[1]), 1});
}

std::optional<Primitive> as_paraboloid(const PrincipalForm& form) {
  if (form.lambda[0] == 0 || form.lambda[1] == 0 || form.b[2] == 0) return std::nullopt;
  const bool elliptic = form.lambda[0] * form.lambda[1] > 0;
  PrincipalForm f = elliptic ? permuted(form, {1, 0, 2}) : form;
  if (f.lambda[0] * f.b[2] > 0) {
    f.axes[2] = -f.axes[2];
    f.b[2] = -f.b[2];
  }
  const Vec3 vertex = f.point(f.middle(0), f.middle(1), -f.rest(2) / f.b[2]);
  return general(elliptic ? SurfaceType::elliptic_paraboloid : SurfaceType::hyperbolic_paraboloid, f, vertex,
                 {std::abs(f.b[2] / (2 * f.lambda[0])), std::abs(f.b[2] / (2 * f.lambda[1])), 0});
}

std::optional<Primitive> as_central(const PrincipalForm& form) {
  if (std::abs(form.lambda[2]) <= kZeroCurvature * std::abs(form.lambda[0])) return std::nullopt;
  const double rest = form.rest(3);
  if (rest == 0) return std::nullopt;
  const std::optional<PrincipalForm> odd = odd_sign_last(form);
  if (!odd && form.lambda[0] * rest > 0) return std::nullopt;
  // Ellipsoids with the longest axis first.
  const PrincipalForm f = odd ? *odd : permuted(form, {2, 1, 0});
  const SurfaceType type = !odd                     ? SurfaceType::ellipsoid
                           : f.lambda[0] * rest < 0 ? SurfaceType::one_sheet_hyperboloid
                                                    : SurfaceType::two_sheet_hyperboloid;
  std::array<double, 3> lengths;
  for (std::size_t k = 0; k < 3; ++k) lengths[k] = std::sqrt(std::abs(rest / f.lambda[k]));
  return general(type, f, f.point(f.middle(0), f.middle(1), f.middle(2)), lengths);
}

// Where a polynomial without real zeros, or with few, is nearest to having a plane of them.
Primitive collapsed(const PrincipalForm& form) {
  if (form.lambda[0] != 0) return make_plane(form.axes[0], form.middle(0));
  const Vec3 b = form.point(form.b[0], form.b[1], form.b[2]);
  return norm(b) > 0 ? make_plane(b, -form.c / norm(b)) : make_plane({0, 0, 1}, 0);
}

// The simplest type within `slack` of all the points. Rounding by `noise` of the polynomial's values takes apart what
// meets itself by the root of that.
Primitive simplest(const PrincipalForm& form, const Points& points, double slack, double noise) {
  std::optional<Primitive> candidate;
  const auto take = [&](std::optional<Primitive> next) {
    candidate = std::move(next);
    if (!candidate) return false;
    const GeneralQuadric* quadric = std::get_if<GeneralQuadric>(&*candidate);
    const bool singular = quadric ? meets_itself(*quadric) : std::holds_alternative<Cone>(*candidate);
    return close(*candidate, points, std::max(slack, singular ? 10 * std::sqrt(noise) : 10 * noise));
  };
  if (points.empty()) return collapsed(form);
  if (take(as_plane(points))) return *candidate;
  if (form.lambda[0] == 0) return collapsed(form);
  if (take(as_sphere(form))) return *candidate;

  const PrincipalForm rank2 = straightened(form, 2, points), rank1 = straightened(rank2, 1, points);
  const PrincipalForm flat2 = levelled(rank2, 2, points), flat1 = levelled(levelled(rank1, 1, points), 2, points);
  if (take(as_cylinder(flat2)) || take(as_cone(form))) return *candidate;
  if (take(as_parallel_planes(flat1)) || take(as_crossing_planes(flat2))) return *candidate;
  if (take(as_parabolic_cylinder(rank1)) || take(as_general_cylinder(flat2))) return *candidate;
  if (take(as_elliptic_cone(form)) || take(as_paraboloid(rank2))) return *candidate;
  if ((candidate = as_central(form)) || (candidate = as_paraboloid(rank2))) return *candidate;
  return collapsed(form);
}

// Of root mean square gradient 1 on the points.
void normalise(Quadric& q, const Points& points) {
  double sum = 0;
  for (const Vec3& p : points) sum += norm2(gradient_of(q, p)) / static_cast<double>(points.size());
  if (!(sum > 0)) return;
  for (double& c : q.c) c /= std::sqrt(sum);
}

// Distances.

double distance_from(const Plane& s, const Vec3& p) { return std::abs(dot(s.normal, p - s.offset * s.normal)); }

double distance_from(const Sphere& s, const Vec3& p) { return std::abs(norm(p - s.centre) - s.radius); }

double distance_from(const Cylinder& s, const Vec3& p) { return std::abs(norm(cross(s.axis, p - s.point)) - s.radius); }

double distance_from(const Cone& s, const Vec3& p) {
  const Vec3 q = p - s.apex;
  return std::abs(norm(cross(s.axis, q)) * std::cos(s.angle) - std::abs(dot(s.axis, q)) * std::sin(s.angle));
}

double distance_from(const Torus& s, const Vec3& p) {
  const Vec3 q = p - s.centre;
  const double rho = norm(cross(s.axis, q)) - s.radius, z = dot(s.axis, q);
  return std::abs(std::sqrt(rho * rho + z * z) - s.minor_radius);
}

double distance_from(const GeneralQuadric& s, const Vec3& p) {
  return approximate_distance(s.polynomial, second_order_of(s.polynomial), p);
}

// Nearest points.

Vec3 foot_on(const Plane& s, const Vec3& p) { return p - dot(s.normal, p - s.offset * s.normal) * s.normal; }

Vec3 foot_on(const Sphere& s, const Vec3& p) {
  const Vec3 q = p - s.centre;
  const double length = norm(q);
  return s.centre + (length > 0 ? (s.radius / length) * q : s.radius * Vec3{0, 0, 1});
}

Vec3 foot_on(const Cylinder& s, const Vec3& p) {
  const Cylindrical q = cylindrical(s.point, s.axis, p);
  return s.point + q.z * s.axis + s.radius * q.outward;
}

Vec3 foot_on(const Cone& s, const Vec3& p) {
  const Cylindrical q = cylindrical(s.apex, s.axis, p);
  const double sine = std::sin(s.angle), cosine = std::cos(s.angle);
  const double slant = q.rho * sine + std::abs(q.z) * cosine;
  return s.apex + slant * (sine * q.outward + (q.z < 0 ? -cosine : cosine) * s.axis);
}

Vec3 foot_on(const Torus& s, const Vec3& p) {
  const Cylindrical q = cylindrical(s.centre, s.axis, p);
  const double rho = q.rho - s.radius, length = std::hypot(rho, q.z);
  const Vec3 out = length > 0 ? (1 / length) * (rho * q.outward + q.z * s.axis) : q.outward;
  return s.centre + s.radius * q.outward + s.minor_radius * out;
}

Vec3 foot_on_plane_pair(const GeneralQuadric& s, const Vec3& p) {
  const double a = s.lengths[0], b = s.lengths[1];
  const Vec3 q = p - s.centre;
  const double x = dot(s.axes[0], q), y = dot(s.axes[1], q);
  if (b == 0) return p + ((x < 0 ? -a : a) - x) * s.axes[0];
  // Both planes contain the common line; the nearer one runs through p's quadrant.
  const double side = x * y < 0 ? -1 : 1;
  const Vec3 normal = b * s.axes[0] - (side * a) * s.axes[1];
  return p - ((b * x - side * a * y) / (a * a + b * b)) * normal;
}

Vec3 foot_on_elliptic_cone(const GeneralQuadric& s, const Vec3& p) {
  // About the apex only second-degree terms are left, and without the others rounding does not move it.
  Quadric about_apex;
  std::copy(s.polynomial.c.begin() + 4, s.polynomial.c.end(), about_apex.c.begin() + 4);
  const Vec3 q = p - s.centre;
  return s.centre + nearest_point(about_apex, s.axes, q).value_or(q);
}

Vec3 foot_on(const GeneralQuadric& s, const Vec3& p) {
  if (s.type == SurfaceType::plane_pair) return foot_on_plane_pair(s, p);
  if (s.type == SurfaceType::elliptic_cone) return foot_on_elliptic_cone(s, p);
  return nearest_point(s.polynomial, s.axes, p).value_or(p);
}

// Types and polynomials.

SurfaceType surface_type(const Plane&) { return SurfaceType::plane; }
SurfaceType surface_type(const Sphere&) { return SurfaceType::sphere; }
SurfaceType surface_type(const Cylinder&) { return SurfaceType::cylinder; }
SurfaceType surface_type(const Cone&) { return SurfaceType::cone; }
SurfaceType surface_type(const Torus&) { return SurfaceType::torus; }
SurfaceType surface_type(const GeneralQuadric& s) { return s.type; }

std::optional<Quadric> polynomial(const Plane& s) { return plane_quadric(s.normal, s.offset); }

std::optional<Quadric> polynomial(const Sphere& sphere) {
  const Vec3& m = sphere.centre;
  const double s = 1 / (2 * sphere.radius);
  return Quadric{
      {s * (norm2(m) - sphere.radius * sphere.radius), -2 * s * m.x, -2 * s * m.y, -2 * s * m.z, s, 0, 0, s, 0, s}};
}

std::optional<Quadric> polynomial(const Cylinder& cylinder) {
  const Vec3& a = cylinder.axis;
  const double s = 1 / (2 * cylinder.radius);
  const Quadric about_point{{-s * cylinder.radius * cylinder.radius, 0, 0, 0, s * (1 - a.x * a.x), -2 * s * a.x * a.y,
                             -2 * s * a.x * a.z, s * (1 - a.y * a.y), -2 * s * a.y * a.z, s * (1 - a.z * a.z)}};
  return from_local(about_point, cylinder.point, 1);
}

std::optional<Quadric> polynomial(const Cone& cone) {
  // The gradient on the surface is as long as the way to the apex.
  const Vec3& a = cone.axis;
  const double s = 1 / std::sin(2 * cone.angle), r = std::cos(cone.angle) * std::cos(cone.angle) * s;
  const Quadric about_apex{{0, 0, 0, 0, r - s * a.x * a.x, -2 * s * a.x * a.y, -2 * s * a.x * a.z, r - s * a.y * a.y,
                            -2 * s * a.y * a.z, r - s * a.z * a.z}};
  return from_local(about_apex, cone.apex, 1);
}

std::optional<Quadric> polynomial(const Torus&) { return std::nullopt; }

std::optional<Quadric> polynomial(const GeneralQuadric& s) { return s.polynomial; }

// In coordinates x = origin + scale y.

Primitive placed(const Plane& s, const Vec3& origin, double scale) {
  return make_plane(s.normal, dot(s.normal, origin + scale * (s.offset * s.normal)));
}

Primitive placed(const Sphere& s, const Vec3& origin, double scale) {
  return make_sphere(origin + scale * s.centre, scale * s.radius);
}

Primitive placed(const Cylinder& s, const Vec3& origin, double scale) {
  return make_cylinder(origin + scale * s.point, s.axis, scale * s.radius);
}

Primitive placed(const Cone& s, const Vec3& origin, double scale) {
  return make_cone(origin + scale * s.apex, s.axis, s.angle);
}

Primitive placed(const Torus& s, const Vec3& origin, double scale) {
  return make_torus(origin + scale * s.centre, s.axis, scale * s.radius, scale * s.minor_radius);
}

Primitive placed(const GeneralQuadric& s, const Vec3& origin, double scale) {
  GeneralQuadric result = s;
  result.centre = origin + scale * s.centre;
  result.polynomial = from_local(s.polynomial, origin, scale);
  for (double& c : result.polynomial.c) c *= scale;
  if (!meets_itself(s))
    for (double& length : result.lengths) length *= scale;
  return result;
}

}  // namespace

const char* name_of(SurfaceType type) {
  switch (type) {
    case SurfaceType::plane: return "plane";
    case SurfaceType::sphere: return "sphere";
    case SurfaceType::cylinder: return "cylinder";
    case SurfaceType::cone: return "cone";
    case SurfaceType::torus: return "torus";
    case SurfaceType::ellipsoid: return "ellipsoid";
    case SurfaceType::elliptic_paraboloid: return "elliptic_paraboloid";
    case SurfaceType::hyperbolic_paraboloid: return "hyperbolic_paraboloid";
    case SurfaceType::one_sheet_hyperboloid: return "one_sheet_hyperboloid";
    case SurfaceType::two_sheet_hyperboloid: return "two_sheet_hyperboloid";
    case SurfaceType::elliptic_cone: return "elliptic_cone";
    case SurfaceType::elliptic_cylinder: return "elliptic_cylinder";
    case SurfaceType::hyperbolic_cylinder: return "hyperbolic_cylinder";
    case SurfaceType::parabolic_cylinder: return "parabolic_cylinder";
    case SurfaceType::plane_pair: return "plane_pair";
  }
  return "";
}

std::pair<Vec3, Vec3> frame_across(const Vec3& axis) {
  const double x = std::abs(axis.x), y = std::abs(axis.y), z = std::abs(axis.z);
  const Vec3 u = unit(cross(axis, x <= y && x <= z ? Vec3{1, 0, 0} : y <= z ? Vec3{0, 1, 0} : Vec3{0, 0, 1}));
  return {u, cross(axis, u)};
}

Vec3 rotated(const Vec3& p, const Vec3& w) {
  const double angle = norm(w);
  if (!(angle > 0)) return p;
  const Vec3 axis = (1 / angle) * w;
  const double along = (1 - std::cos(angle)) * dot(axis, p);
  return std::cos(angle) * p + std::sin(angle) * cross(axis, p) + along * axis;
}

SurfaceType type_of(const Primitive& primitive) {
  return std::visit([](const auto& s) { return surface_type(s); }, primitive);
}

std::optional<Quadric> quadric_of(const Primitive& primitive) {
  return std::visit([](const auto& s) { return polynomial(s); }, primitive);
}

double distance(const Primitive& primitive, const Vec3& p) {
  return std::visit([&](const auto& s) { return distance_from(s, p); }, primitive);
}

Vec3 foot_point(const Primitive& primitive, const Vec3& p) {
  return std::visit([&](const auto& s) { return foot_on(s, p); }, primitive);
}

Plane make_plane(const Vec3& normal, double offset) {
  const double length = norm(normal);
  const Vec3 direction = require_direction(normal, "normal of a plane");
  return {direction, offset / length};
}

Sphere make_sphere(const Vec3& centre, double radius) {
  require_length(radius, "radius of a sphere");
  return {centre, radius};
}

Cylinder make_cylinder(const Vec3& point, const Vec3& axis, double radius) {
  require_length(radius, "radius of a cylinder");
  const Vec3 direction = require_direction(axis, "axis of a cylinder");
  return {point - dot(point, direction) * direction, direction, radius};
}

Cone make_cone(const Vec3& apex, const Vec3& axis, double angle) {
  if (!(angle > 0 && angle < std::acos(0.0))) throw Error("angle of a cone is not between 0 and pi/2: give radians");
  return {apex, require_direction(axis, "axis of a cone"), angle};
}

Torus make_torus(const Vec3& centre, const Vec3& axis, double radius, double minor_radius) {
  require_length(minor_radius, "minor radius of a torus");
  if (!(radius > minor_radius) || !std::isfinite(radius))
    throw Error("radius of a torus is not greater than its minor radius: tori that meet themselves are not supported");
  return {centre, require_direction(axis, "axis of a torus"), radius, minor_radius};
}

Primitive classify(const Quadric& quadric, const Vec3& near, double extent, double tolerance) {
  require_length(extent, "extent of a quadric");
  Quadric local = to_local(quadric, near, extent), absolute;
  for (std::size_t k = 0; k < 10; ++k) absolute.c[k] = std::abs(quadric.c[k]);
  const double rounding = std::numeric_limits<double>::epsilon() *
                          value_of(absolute, {std::abs(near.x), std::abs(near.y), std::abs(near.z)});
  double greatest = 0;
  for (double c : local.c) greatest = std::isfinite(c) ? std::max(greatest, std::abs(c)) : c;
  if (!std::isfinite(greatest)) throw Error("coefficient of a quadric is not finite: give finite ones");
  if (greatest > 0)
    for (double& c : local.c) c /= greatest;

  const PrincipalForm form = principal_form(local);
  const Points points = surface_points(local, form.axes);
  Primitive result =
      simplest(form, points, std::max(tolerance / extent, kRounding), greatest > 0 ? rounding / greatest : 0);
  if (auto* general = std::get_if<GeneralQuadric>(&result)) normalise(general->polynomial, points);
  const auto* plane = std::get_if<Plane>(&result);
  if (plane && !points.empty() && dot(gradient_of(local, points[0]), plane->normal) < 0)
    result = make_plane(-plane->normal, -dot(plane->normal, plane->offset * plane->normal));
  return from_local(result, near, extent);
}

Primitive from_local(const Primitive& local, const Vec3& origin, double scale) {
  return std::visit([&](const auto& s) { return placed(s, origin, scale); }, local);
}

}  // namespace bisector
