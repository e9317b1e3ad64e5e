#include "tree/bspline.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "bisector/error.h"

namespace bisector {
namespace {

// Weights of the control polygon's bends beside the points' distances (Eilers and Marx 1996). The least still decides
// where spans have no points.
constexpr std::array<double, 4> kSmoothing{1e-2, 1e-4, 1e-6, 1e-8};
constexpr int kCorrections = 4;     // of the parameters, for each smoothing
constexpr double kProgress = 0.95;  // ratio of the largest excess after a correction to that before, at most, to go on
constexpr double kGrowth = 1.25;    // of the number of control points, from one try to the next

// The knot interval of t that is not empty.
std::size_t span_of(const std::vector<double>& knots, std::size_t degree, double t) {
  const std::size_t last = knots.size() - degree - 2;
  const auto above = std::upper_bound(knots.begin() + degree, knots.begin() + last + 1, t);
  std::size_t span = std::max<std::size_t>(degree, static_cast<std::size_t>(above - knots.begin()) - 1);
  while (span > degree && !(knots[span] < knots[span + 1])) --span;
  return span;
}

// The functions of each degree up to `degree` that are not zero at t (clamped to the domain).
struct Recursion {
  std::size_t span = 0;
  std::array<std::array<double, 4>, 4> values{};
};

Recursion recur(const std::vector<double>& knots, std::size_t degree, double t) {
  t = std::clamp(t, knots[degree], knots[knots.size() - degree - 1]);
  Recursion r;
  r.span = span_of(knots, degree, t);
  r.values[0][0] = 1;
  for (std::size_t d = 1; d <= degree; ++d)
    for (std::size_t k = 0; k < d; ++k) {
      const std::size_t i = r.span - d + k + 1;
      const double share = r.values[d - 1][k] / (knots[i + d] - knots[i]);
      r.values[d][k] += (knots[i + d] - t) * share;
      r.values[d][k + 1] += (t - knots[i]) * share;
    }
  return r;
}

// The next derivative of the functions of degree d from those of degree d - 1.
std::array<double, 4> differentiate(const std::vector<double>& knots, std::size_t span, std::size_t d,
                                    const std::array<double, 4>& lower) {
  std::array<double, 4> result{};
  for (std::size_t k = 0; k < d; ++k) {
    const std::size_t i = span - d + k + 1;
    const double slope = static_cast<double>(d) * lower[k] / (knots[i + d] - knots[i]);
    result[k] -= slope;
    result[k + 1] += slope;
  }
  return result;
}

Vec3 combine(const std::array<double, 4>& weights, const BSplineCurve& curve, std::size_t first) {
  Vec3 sum;
  for (std::size_t k = 0; k <= static_cast<std::size_t>(curve.degree); ++k)
    sum += weights[k] * curve.control[first + k];
  return sum;
}

std::vector<double> uniform_knots(std::size_t control, std::size_t degree) {
  std::vector<double> knots(degree + 1, 0.0);
  const std::size_t spans = control - degree;
  for (std::size_t i = 1; i < spans; ++i) knots.push_back(static_cast<double>(i) / static_cast<double>(spans));
  knots.insert(knots.end(), degree + 1, 1.0);
  return knots;
}

std::vector<double> chord_parameters(const std::vector<Vec3>& points) {
  std::vector<double> t(points.size());
  for (std::size_t i = 1; i < points.size(); ++i) t[i] = t[i - 1] + norm(points[i] - points[i - 1]);
  const double length = t.back();
  for (double& value : t) value /= length;
  t.back() = 1;
  return t;
}

// Points without consecutive equal ones, about the first and in units of the path's length; `index` tells which of them
// each input point became.
struct NormalisedPath {
  std::vector<Vec3> points;
  std::vector<double> tolerances, weights;
  std::vector<std::size_t> index;
  Vec3 origin;
  double length = 0;
};

// The control points that minimise the points' weighted squared distances at their parameters and, by the weight
// `smoothing`, the squared changes of the derivative's control points; the first and the last are the points'.
std::vector<Vec3> solve_control(const NormalisedPath& path, const std::vector<double>& parameters,
                                const std::vector<double>& knots, std::size_t degree, double smoothing) {
  const std::vector<Vec3>& points = path.points;
  const std::size_t count = knots.size() - degree - 1;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(count));
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(count), 3);
  const auto add_row = [&](std::size_t first, const std::array<double, 4>& row, std::size_t size, double weight,
                           const Vec3& value) {
    for (std::size_t a = 0; a < size; ++a) {
      const auto i = static_cast<Eigen::Index>(first + a);
      for (std::size_t b = 0; b < size; ++b)
        normal(i, static_cast<Eigen::Index>(first + b)) += weight * row[a] * row[b];
      for (int k = 0; k < 3; ++k) right(i, k) += weight * row[a] * value[k];
    }
  };
  double total = 0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const BasisFunctions basis = basis_functions(knots, static_cast<int>(degree), parameters[p]);
    add_row(basis.first, basis.values, degree + 1, path.weights[p], points[p]);
    total += path.weights[p];
  }
  const double density = std::max(1.0, total / static_cast<double>(count));
  const double spacing = 1 / static_cast<double>(count - 1);
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const double before = static_cast<double>(degree) * spacing / (knots[i + degree] - knots[i]);
    const double after = static_cast<double>(degree) * spacing / (knots[i + degree + 1] - knots[i + 1]);
    add_row(i - 1, {before, -before - after, after, 0}, 3, smoothing * density, {});
  }

  std::vector<Vec3> control(count);
  control.front() = points.front();
  control.back() = points.back();
  if (count == 2) return control;
  const auto inner = static_cast<Eigen::Index>(count - 2);
  Eigen::MatrixXd ends(2, 3);
  for (int k = 0; k < 3; ++k) {
    ends(0, k) = control.front()[k];
    ends(1, k) = control.back()[k];
  }
  Eigen::MatrixXd columns(inner, 2);
  columns << normal.block(1, 0, inner, 1), normal.block(1, inner + 1, inner, 1);
  const Eigen::MatrixXd solution =
      normal.block(1, 1, inner, inner).ldlt().solve(right.block(1, 0, inner, 3) - columns * ends);
  for (Eigen::Index i = 0; i < inner; ++i)
    control[static_cast<std::size_t>(i) + 1] = {solution(i, 0), solution(i, 1), solution(i, 2)};
  return control;
}

// Of the points from the curve at their parameters.
std::vector<double> distances(const BSplineCurve& curve, const std::vector<Vec3>& points,
                              const std::vector<double>& parameters) {
  std::vector<double> result(points.size());
  for (std::size_t p = 0; p < points.size(); ++p) result[p] = norm(curve.point(parameters[p]) - points[p]);
  return result;
}

double largest_excess(const std::vector<double>& distance, const std::vector<double>& tolerances) {
  double largest = distance[0] - tolerances[0];
  for (std::size_t p = 1; p < distance.size(); ++p) largest = std::max(largest, distance[p] - tolerances[p]);
  return largest;
}

// Between consecutive points, the curve is no farther from their chord than they are from the curve and half the chord.
// A fit that is near points but swings out between them is none.
bool stays_near(const BSplineCurve& curve, const std::vector<Vec3>& points, const std::vector<double>& parameters,
                const std::vector<double>& distance) {
  for (std::size_t p = 1; p < points.size(); ++p) {
    const Vec3 chord = points[p] - points[p - 1];
    const double allowed = std::max(distance[p - 1], distance[p]) + 0.5 * norm(chord);
    for (const double x : {0.2, 0.4, 0.6, 0.8}) {
      const Vec3 off = curve.point(parameters[p - 1] + x * (parameters[p] - parameters[p - 1])) - points[p - 1];
      const double foot = std::clamp(dot(off, chord) / norm2(chord), 0.0, 1.0);
      if (norm(off - foot * chord) > allowed) return false;
    }
  }
  return true;
}

// One Newton step of each parameter towards its point's foot, at most half way to its neighbours.
std::vector<double> correct_parameters(const BSplineCurve& curve, const std::vector<Vec3>& points,
                                       const std::vector<double>& t) {
  std::vector<double> corrected = t;
  for (std::size_t p = 1; p + 1 < points.size(); ++p) {
    const BasisFunctions basis = basis_functions(curve.knots, curve.degree, t[p]);
    const Vec3 offset = combine(basis.values, curve, basis.first) - points[p];
    const Vec3 first = combine(basis.derivatives, curve, basis.first);
    const double slope = dot(offset, first);
    double bend = norm2(first) + dot(offset, combine(basis.second_derivatives, curve, basis.first));
    if (!(bend > 0.1 * norm2(first))) bend = norm2(first);
    const double step = bend > 0 ? -slope / bend : 0;
    corrected[p] = std::clamp(t[p] + step, 0.5 * (t[p - 1] + t[p]), 0.5 * (t[p] + t[p + 1]));
  }
  return corrected;
}

NormalisedPath normalise(const std::vector<Vec3>& points, const std::vector<double>& tolerances) {
  NormalisedPath path;
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (!std::isfinite(points[p].x) || !std::isfinite(points[p].y) || !std::isfinite(points[p].z))
      throw Error(fmt::format("curve fit: point {} is not finite; remove it", p));
    if (!(tolerances[p] >= 0))
      throw Error(fmt::format("curve fit: tolerance {}; give a length, 0 or more", tolerances[p]));
    const Vec3 local = points[p] - points[0];
    if (path.points.empty() || !(local == path.points.back())) {
      if (!path.points.empty()) path.length += norm(local - path.points.back());
      path.points.push_back(local);
      path.tolerances.push_back(tolerances[p]);
    }
    path.tolerances.back() = std::min(path.tolerances.back(), tolerances[p]);
    path.index.push_back(path.points.size() - 1);
  }
  if (path.points.size() < 2 || !(path.length > 0))
    throw Error("curve fit: fewer than two distinct points; give two or more");
  if (!std::isfinite(path.length))
    throw Error("curve fit: the points are farther apart than numbers reach; scale them");
  path.origin = points[0];
  for (Vec3& p : path.points) p *= 1 / path.length;
  double strictest = 0;
  for (double& tolerance : path.tolerances) {
    tolerance /= path.length;
    if (tolerance > 0 && (strictest <= 0 || tolerance < strictest)) strictest = tolerance;
  }
  for (const double tolerance : path.tolerances)
    path.weights.push_back(tolerance > strictest ? strictest / tolerance * (strictest / tolerance) : 1);
  return path;
}

struct Attempt {
  BSplineCurve curve;  // without control points: none stayed near
  std::vector<double> parameters;
  double excess = 0;  // of a point's distance over its tolerance, at most
};

// The nearest curve of `count` control points, of the smoothings the first that is within the tolerances.
Attempt fit_with(const NormalisedPath& path, std::size_t count) {
  Attempt best;
  const std::size_t degree = std::min<std::size_t>(3, count - 1);
  for (const double smoothing : kSmoothing) {
    Attempt fit;
    fit.curve.degree = static_cast<int>(degree);
    fit.curve.knots = uniform_knots(count, degree);
    fit.parameters = chord_parameters(path.points);
    for (int c = 0; c <= kCorrections; ++c) {
      const double before = fit.excess;
      if (c > 0) fit.parameters = correct_parameters(fit.curve, path.points, fit.parameters);
      fit.curve.control = solve_control(path, fit.parameters, fit.curve.knots, degree, smoothing);
      const std::vector<double> distance = distances(fit.curve, path.points, fit.parameters);
      fit.excess = largest_excess(distance, path.tolerances);
      if (c > 0 && fit.excess > kProgress * before) break;
      if (best.curve.control.empty() || fit.excess < best.excess) {
        if (!stays_near(fit.curve, path.points, fit.parameters, distance)) continue;
        best = fit;
        if (best.excess <= 0) return best;
      }
    }
    if (count == 2) break;
  }
  return best;
}

}  // namespace

BasisFunctions basis_functions(const std::vector<double>& knots, int degree, double t) {
  const auto p = static_cast<std::size_t>(degree);
  const Recursion r = recur(knots, p, t);
  BasisFunctions basis;
  basis.first = r.span - p;
  basis.values = r.values[p];
  basis.derivatives = differentiate(knots, r.span, p, r.values[p - 1]);
  if (p > 1)
    basis.second_derivatives = differentiate(knots, r.span, p, differentiate(knots, r.span, p - 1, r.values[p - 2]));
  return basis;
}

Vec3 BSplineCurve::point(double t) const {
  const auto p = static_cast<std::size_t>(degree);
  const Recursion r = recur(knots, p, t);
  return combine(r.values[p], *this, r.span - p);
}

Vec3 BSplineCurve::derivative(double t) const {
  const auto p = static_cast<std::size_t>(degree);
  const Recursion r = recur(knots, p, t);
  return combine(differentiate(knots, r.span, p, r.values[p - 1]), *this, r.span - p);
}

Vec3 BSplineCurve::second_derivative(double t) const {
  const BasisFunctions basis = basis_functions(knots, degree, t);
  return combine(basis.second_derivatives, *this, basis.first);
}

BSplineCurve as_cubic(const BSplineCurve& curve) {
  BSplineCurve cubic = curve;
  while (cubic.degree < 3) {
    const std::vector<Vec3> old = cubic.control;
    const double raised = ++cubic.degree;
    cubic.control.assign(1, old.front());
    for (std::size_t i = 1; i < old.size(); ++i) {
      const double a = static_cast<double>(i) / raised;
      cubic.control.push_back(a * old[i - 1] + (1 - a) * old[i]);
    }
    cubic.control.push_back(old.back());
    cubic.knots = uniform_knots(cubic.control.size(), cubic.control.size() - 1);
  }
  return cubic;
}

BSplineCurve insert_knot(const BSplineCurve& curve, double t) {
  const auto p = static_cast<std::size_t>(curve.degree);
  const std::size_t span = span_of(curve.knots, p, t);
  BSplineCurve finer = curve;
  finer.knots.insert(finer.knots.begin() + static_cast<std::ptrdiff_t>(span) + 1, t);
  finer.control.insert(finer.control.begin() + static_cast<std::ptrdiff_t>(span), curve.control[span]);
  for (std::size_t i = span - p + 1; i <= span; ++i) {
    const double a = (t - curve.knots[i]) / (curve.knots[i + p] - curve.knots[i]);
    finer.control[i] = (1 - a) * curve.control[i - 1] + a * curve.control[i];
  }
  return finer;
}

CurveFit fit_curve(const std::vector<Vec3>& points, double tolerance, std::size_t max_control) {
  return fit_curve(points, std::vector<double>(points.size(), tolerance), max_control);
}

CurveFit fit_curve(const std::vector<Vec3>& points, const std::vector<double>& tolerances, std::size_t max_control) {
  if (points.size() != tolerances.size())
    throw Error(fmt::format("curve fit: {} tolerances for {} points; give one each", tolerances.size(), points.size()));
  if (max_control < 2) throw Error(fmt::format("curve fit: {} control points; allow 2 or more", max_control));
  const NormalisedPath path = normalise(points, tolerances);

  Attempt best;
  const std::size_t most = path.points.size() == 2 ? 2 : max_control;
  for (std::size_t count = 2;;) {
    Attempt attempt = fit_with(path, count);
    if (best.curve.control.empty() || (!attempt.curve.control.empty() && attempt.excess < best.excess))
      best = std::move(attempt);
    if (best.excess <= 0 || count >= most) break;
    count = std::min(most, std::max(count + 1, static_cast<std::size_t>(kGrowth * static_cast<double>(count))));
  }

  CurveFit result;
  result.curve = std::move(best.curve);
  for (Vec3& c : result.curve.control) c = path.origin + path.length * c;
  result.curve.control.back() = points.back();
  for (const std::size_t i : path.index) result.parameters.push_back(best.parameters[i]);
  const std::vector<double> distance = distances(result.curve, points, result.parameters);
  result.max_distance = *std::max_element(distance.begin(), distance.end());
  return result;
}

}  // namespace bisector
