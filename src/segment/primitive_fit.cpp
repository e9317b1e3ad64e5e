#include "segment/primitive_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <numbers>
#include <utility>

#include "bisector/error.h"

namespace bisector {
namespace {

using std::numbers::pi;

// What fits are refused for. Lengths are in extents of the points: the greatest distance from their centroid.
constexpr double kLargest = 1e3;  // radii at most: larger surfaces are flat over the points, up to rounding
constexpr double kLeastAngle = 0.1 * pi / 180;  // radians, of a cone that is neither a cylinder nor a plane
constexpr double kExact = 1e-22;                // mean squared distance that is rounding
constexpr double kGain = 10;  // a surface must lessen a simpler one's variance by this part over the number of points
constexpr double kLeastPivot =
    1e-13;  // of the normal equations, in the greatest one: the points determine all unknowns

// How starts are compared: the best few on a part of the samples, the winner on all of them.
constexpr std::size_t kScreened = 64;        // samples
constexpr std::size_t kTried = 4;            // starts that take steps
constexpr int kFirstSteps = 4, kSteps = 60;  // of Levenberg and Marquardt, on the part and on all
constexpr int kMaxUnknowns = 7;

using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxUnknowns, 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxUnknowns, kMaxUnknowns>;

// Samples of positive weight about their centroid, in units of their greatest distance to it, of total weight 1.
struct Local {
  std::vector<Vec3> points, normals;
  std::vector<double> weights;
  Vec3 origin;
  double scale = 0, total = 0;
};

Local to_local(const SurfaceSamples& samples) {
  const std::size_t n = samples.points.size();
  if (samples.normals.size() != n || samples.weights.size() != n)
    throw Error("surface samples have " + std::to_string(n) + " points, " + std::to_string(samples.normals.size()) +
                " normals and " + std::to_string(samples.weights.size()) + " weights: give as many of each");
  Local local;
  for (std::size_t i = 0; i < n; ++i) {
    if (!(samples.weights[i] >= 0) ||
        !std::isfinite(samples.weights[i] + norm2(samples.points[i]) + norm2(samples.normals[i])))
      throw Error("surface sample " + std::to_string(i) + " has a negative weight or a number that is not finite");
    if (samples.weights[i] == 0) continue;
    local.points.push_back(samples.points[i]);
    local.normals.push_back(samples.normals[i]);
    local.weights.push_back(samples.weights[i]);
    local.total += samples.weights[i];
  }
  if (local.points.empty()) return local;

  // Coordinates are taken from the first point, so that far ones lose nothing.
  const Vec3 first = local.points[0];
  for (std::size_t i = 0; i < local.points.size(); ++i) {
    local.weights[i] /= local.total;
    local.points[i] -= first;
    local.origin += local.weights[i] * local.points[i];
  }
  for (Vec3& p : local.points) {
    p -= local.origin;
    local.scale = std::max(local.scale, norm(p));
  }
  local.origin += first;
  if (!(local.scale > 0)) return local;
  for (Vec3& p : local.points) p *= 1 / local.scale;

  return local;
}

// Every so many of the samples.
Local thinned(const Local& local) {
  const std::size_t n = local.points.size(), step = (n + kScreened - 1) / kScreened;
  if (step == 1) return local;
  Local thin;
  double total = 0;
  for (std::size_t i = 0; i < n; i += step) {
    thin.points.push_back(local.points[i]);
    thin.normals.push_back(local.normals[i]);
    thin.weights.push_back(local.weights[i]);
    total += local.weights[i];
  }
  for (double& w : thin.weights) w /= total;
  return thin;
}

// A sphere, cylinder, cone or torus while it is fitted. Of cylinders and cones `centre` is the axis' point nearest the
// origin.
struct Shape {
  SurfaceType type;
  Vec3 centre, axis{0, 0, 1};
  double radius = 0;            // of a cone: the distance from `centre` to the cone
  double minor_radius = 0;      // of a torus
  double angle = 0;             // of a cone
  double sine = 0, cosine = 1;  // of the angle
};

constexpr int unknowns(SurfaceType type) {
  switch (type) {
    case SurfaceType::plane: return 3;
    case SurfaceType::sphere: return 4;
    case SurfaceType::cylinder: return 5;
    case SurfaceType::cone: return 6;
    default: return kMaxUnknowns;
  }
}

// Brings a shape into its normal form: axis, signs and centre. False if its numbers describe no surface of its type.
bool normalise(Shape& shape) {
  if (!std::isfinite(norm2(shape.centre) + norm2(shape.axis) + shape.radius + shape.minor_radius + shape.angle))
    return false;
  shape.axis *= 1 / norm(shape.axis);
  if (shape.type == SurfaceType::cone) {
    if (shape.angle < 0) {
      shape.angle = -shape.angle;
      shape.axis = -shape.axis;
    }
    if (shape.angle >= pi / 2) return false;
    shape.sine = std::sin(shape.angle);
    shape.cosine = std::cos(shape.angle);
    const double along = dot(shape.centre, shape.axis);
    shape.centre -= along * shape.axis;
    shape.radius -= along * shape.sine;
    return true;
  }
  if (shape.type == SurfaceType::cylinder) shape.centre -= dot(shape.centre, shape.axis) * shape.axis;
  return shape.radius > 0 && (shape.type != SurfaceType::torus || shape.minor_radius > 0);
}

// Signed distance of a point, the unit normal at its foot, and the distance's derivatives by the radius and by a torus'
// minor radius or a cone's angle.
struct Residual {
  double d;
  Vec3 normal;
  double by_radius, by_second;
  Vec3 out = normal;  // of a torus away from its axis, across it
};

template <SurfaceType type>
inline Residual residual(const Shape& shape, const Vec3& p) {
  const Vec3 q = p - shape.centre;
  if constexpr (type == SurfaceType::sphere) {
    const double length = norm(q);
    return {length - shape.radius, length > 0 ? (1 / length) * q : shape.axis, -1, 0};
  }
  const double z = dot(shape.axis, q);
  Vec3 out = q - z * shape.axis;
  const double rho = norm(out);
  if (rho > 0) out *= 1 / rho;
  if constexpr (type == SurfaceType::cylinder) return {rho - shape.radius, out, -1, 0};
  if constexpr (type == SurfaceType::cone) {
    // Of the nappe that the axis points into, continued beyond the apex: both together can take up a plane's noise.
    return {rho * shape.cosine - shape.radius - z * shape.sine, shape.cosine * out - shape.sine * shape.axis, -1,
            -rho * shape.sine - z * shape.cosine};
  }
  const double beyond = rho - shape.radius, length = std::sqrt(beyond * beyond + z * z);
  const double cosine = length > 0 ? beyond / length : 0, sine = length > 0 ? z / length : 0;
  return {length - shape.minor_radius, cosine * out + sine * shape.axis, -cosine, -1, out};
}

// Calls one of a template's instances for a type.
template <class Function>
auto for_type(SurfaceType type, const Function& function) {
  switch (type) {
    case SurfaceType::sphere: return function.template operator()<SurfaceType::sphere>();
    case SurfaceType::cylinder: return function.template operator()<SurfaceType::cylinder>();
    case SurfaceType::cone: return function.template operator()<SurfaceType::cone>();
    default: return function.template operator()<SurfaceType::torus>();
  }
}

double energy(const Shape& shape, const Local& local) {
  return for_type(shape.type, [&]<SurfaceType type>() {
    double sum = 0;
    for (std::size_t i = 0; i < local.points.size(); ++i) {
      const double d = residual<type>(shape, local.points[i]).d;
      sum += local.weights[i] * d * d;
    }
    return sum;
  });
}

// The unknowns: translations across the axis (a sphere's, a torus' along it too), rotations about the origin across the
// axis, then the radius, then the minor radius or the angle. A translation t and a rotation w of the surface change the
// distance of p by -n.t and -w.(p x n).
struct NormalEquations {
  Matrix matrix;
  Vector right;
  double energy = 0;
  Vec3 normal, out;  // means
};

NormalEquations normal_equations(const Shape& shape, const Local& local) {
  return for_type(shape.type, [&]<SurfaceType type>() {
    constexpr int n = unknowns(type);
    const auto [u, v] = frame_across(shape.axis);
    double m[n][n] = {}, r[n] = {}, j[n];
    NormalEquations equations;
    for (std::size_t i = 0; i < local.points.size(); ++i) {
      const Vec3& p = local.points[i];
      const Residual f = residual<type>(shape, p);
      int k = 0;
      j[k++] = -dot(f.normal, u);
      j[k++] = -dot(f.normal, v);
      if constexpr (type == SurfaceType::sphere || type == SurfaceType::torus) j[k++] = -dot(f.normal, shape.axis);
      if constexpr (type != SurfaceType::sphere) {
        const Vec3 moment = cross(p, f.normal);
        j[k++] = -dot(moment, u);
        j[k++] = -dot(moment, v);
      }
      j[k++] = f.by_radius;
      if constexpr (type == SurfaceType::cone || type == SurfaceType::torus) j[k] = f.by_second;
      const double w = local.weights[i];
      for (int a = 0; a < n; ++a) {
        const double wj = w * j[a];
        r[a] -= wj * f.d;
        for (int b = 0; b <= a; ++b) m[a][b] += wj * j[b];
      }
      equations.energy += w * f.d * f.d;
      equations.normal += w * f.normal;
      equations.out += w * f.out;
    }
    equations.matrix.resize(n, n);
    equations.right.resize(n);
    for (int a = 0; a < n; ++a) {
      equations.right(a) = r[a];
      for (int b = 0; b <= a; ++b) equations.matrix(a, b) = equations.matrix(b, a) = m[a][b];
    }
    return equations;
  });
}

// A radius after a step that is linear in its inverse: distances are, nearly, where points cover little of the surface.
double stepped_radius(double radius, double step) {
  return step < radius / 2 ? radius * radius / (radius - step) : radius + 2 * step;
}

Shape stepped(const Shape& shape, const NormalEquations& at, const Vector& step) {
  const auto [u, v] = frame_across(shape.axis);
  Shape next = shape;
  int k = 2;
  Vec3 move = step(0) * u + step(1) * v;
  if (shape.type == SurfaceType::sphere || shape.type == SurfaceType::torus) move += step(k++) * shape.axis;
  Vec3 turn;
  if (shape.type != SurfaceType::sphere) {
    turn = step(k) * u + step(k + 1) * v;
    k += 2;
  }
  if (shape.type == SurfaceType::cone) {
    // The circle across `centre` takes the linear step, so that it stays on the surface under large changes of the
    // angle.
    const double radius =
        (shape.radius + step(k) + shape.radius * shape.sine / shape.cosine * step(k + 1)) / shape.cosine;
    next.radius = radius * std::cos(shape.angle + step(k + 1));
    next.angle += step(k + 1);
  } else {
    // What the radii change beyond the step, the surface moves back, so that it stays where the points are.
    next.radius = stepped_radius(shape.radius, step(k));
    if (shape.type == SurfaceType::torus) {
      next.minor_radius = stepped_radius(shape.minor_radius, step(k + 1));
      const double beyond = next.minor_radius - shape.minor_radius - step(k + 1);
      move -= beyond * at.normal;
    }
    move -= (next.radius - shape.radius - step(k)) * at.out;
  }
  next.axis = rotated(shape.axis, turn);
  next.centre = rotated(shape.centre + move, turn);
  return next;
}

// Levenberg-Marquardt, with Marquardt's scaling.
NormalEquations descend(Shape& shape, const Local& local, int steps) {
  NormalEquations at = normal_equations(shape, local);
  double damping = 1e-3;
  for (int i = 0; i < steps && at.energy > 1e-32; ++i) {
    Matrix damped = at.matrix;
    damped.diagonal() += (damping * at.matrix.diagonal()).cwiseMax(1e-30);
    const Vector step = damped.ldlt().solve(at.right);
    Shape next = stepped(shape, at, step);
    if (step.allFinite() && normalise(next)) {
      NormalEquations there = normal_equations(next, local);
      if (there.energy < at.energy) {
        const bool done = at.energy - there.energy < 1e-7 * at.energy;
        shape = next;
        at = std::move(there);
        damping = damping < 1e-9 ? 0 : 0.05 * damping;
        if (done) break;
        continue;
      }
      if (there.energy <= at.energy * (1 + 1e-13)) break;
    }
    damping = std::max(1e-4, 8 * damping);
    if (damping > 1e8) break;
  }
  return at;
}

// Taubin's circle or sphere: the smallest eigenvector for points x and their squares, the constant being eliminated.
template <int N>
struct RoundFit {
  Eigen::Matrix<double, N, 1> centre;
  double radius = 0;  // 0: flat
};

template <int N>
class RoundFitter {
 public:
  using Point = Eigen::Matrix<double, N, 1>;
  void add(const Point& x, double weight) {
    Eigen::Matrix<double, N + 1, 1> v;
    v << x.squaredNorm(), x;
    weight_ += weight;
    mean_ += weight * v;
    second_ += weight * v * v.transpose();
  }
  RoundFit<N> fit() const {
    const Eigen::Matrix<double, N + 1, 1> mean = mean_ / weight_;
    const Point centroid = mean.template tail<N>();
    const Eigen::Matrix<double, N + 1, N + 1> about = second_ / weight_ - mean * mean.transpose();
    // (|x|^2 - 2 x . centroid) in place of |x|^2 moves the points to their centroid.
    Eigen::Matrix<double, N + 1, N + 1> move = Eigen::Matrix<double, N + 1, N + 1>::Identity();
    move.template block<1, N>(0, 1) = -2 * centroid.transpose();
    const double spread = about.template bottomRightCorner<N, N>().trace();
    RoundFit<N> result;
    if (!(spread > 0)) return result;
    move.row(0) /= 2 * std::sqrt(spread);
    const Eigen::Matrix<double, N + 1, N + 1> matrix = move * about * move.transpose();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N + 1, N + 1>> solver;
    if constexpr (N == 2) solver.computeDirect(matrix);
    else solver.compute(matrix);
    const Eigen::Matrix<double, N + 1, 1> c = solver.eigenvectors().col(0);
    const double quadratic = c(0) / (2 * std::sqrt(spread));
    if (!(std::abs(quadratic) > 1e-9)) return result;
    const Point offset = c.template tail<N>() / (-2 * quadratic);
    result.centre = centroid + offset;
    result.radius = std::sqrt(offset.squaredNorm() + spread);
    return result;
  }

 private:
  double weight_ = 0;
  Eigen::Matrix<double, N + 1, 1> mean_ = Eigen::Matrix<double, N + 1, 1>::Zero();
  Eigen::Matrix<double, N + 1, N + 1> second_ = Eigen::Matrix<double, N + 1, N + 1>::Zero();
};

Eigen::Vector3d eigen(const Vec3& p) { return {p.x, p.y, p.z}; }
Vec3 vec3(const Eigen::Vector3d& p) { return {p(0), p(1), p(2)}; }

// Sums over the samples that axes are found from.
struct Sums {
  Eigen::Matrix3d points = Eigen::Matrix3d::Zero();   // p p'
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();  // n n'
  Eigen::Matrix3d mixed = Eigen::Matrix3d::Zero();    // (p x n) n'
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();  // (p x n) (p x n)'
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();     // n
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();   // n (n . p)

  explicit Sums(const Local& local) {
    for (std::size_t i = 0; i < local.points.size(); ++i) {
      const Eigen::Vector3d p = eigen(local.points[i]), n = eigen(local.normals[i]), m = p.cross(n);
      const double w = local.weights[i];
      points += w * p * p.transpose();
      normals += w * n * n.transpose();
      mixed += w * m * n.transpose();
      moments += w * m * m.transpose();
      mean += w * n;
      offset += (w * n.dot(p)) * n;
    }
  }
};

using Directions = std::vector<Vec3>;

void add_eigenvectors(const Eigen::Matrix3d& matrix, int count, Directions& directions) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
  for (int k = 0; k < count; ++k) directions.push_back(vec3(solver.eigenvectors().col(k)));
}

// Directions of axes: of the rotations to whose velocities the normals are orthogonal, the lines of the normals being
// in a linear complex (Pottmann and Randrup 1998); of planes that the normals lie in; and the points' principal axes.
Directions axis_directions(const Sums& sums) {
  Directions directions;
  const Eigen::Matrix3d regular = sums.normals + 1e-9 * Eigen::Matrix3d::Identity();
  add_eigenvectors(sums.moments - sums.mixed * regular.inverse() * sums.mixed.transpose(), 3, directions);
  add_eigenvectors(sums.normals, 2, directions);
  add_eigenvectors(sums.normals - sums.mean * sums.mean.transpose(), 1, directions);
  add_eigenvectors(sums.points, 3, directions);
  return directions;
}

// The point of the plane across the axis that the lines of the normals pass most closely by.
Vec3 axis_point(const Sums& sums, const Vec3& axis) {
  // Sum of ((p - x) . (axis x n))^2; (p . (axis x n)) = -axis . (p x n).
  const auto [u, v] = frame_across(axis);
  const Eigen::Vector3d a = eigen(axis), eu = eigen(u), ev = eigen(v);
  // x . (axis x n) = (x x axis) . n, with u x axis = -v and v x axis = u.
  Eigen::Matrix2d matrix;
  const double uu = ev.dot(sums.normals * ev), vv = eu.dot(sums.normals * eu), uv = -eu.dot(sums.normals * ev);
  matrix << uu, uv, uv, vv;
  const Eigen::Vector3d pull = sums.mixed.transpose() * a;
  const Eigen::Vector2d right(pull.dot(ev), -pull.dot(eu));
  const Eigen::Vector2d x = (matrix + 1e-12 * Eigen::Matrix2d::Identity()).inverse() * right;
  return x(0) * u + x(1) * v;
}

struct Axis {
  Vec3 point, direction;
};

// For a small patch, whose points tell more than its normals: a surface of revolution has a centre of curvature on its
// axis, and the axis in the plane of the surface's normal and of the other principal direction. The slope in that plane
// depends on third derivatives, so some are tried.
void add_axes_by_curvature(const Local& local, const Sums& sums, const std::vector<double>& slopes,
                           std::vector<Axis>& axes) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> frame(sums.points);
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6 right = Vector6::Zero();
  const Eigen::Vector3d n = frame.eigenvectors().col(0), x = frame.eigenvectors().col(1),
                        y = frame.eigenvectors().col(2);
  for (std::size_t i = 0; i < local.points.size(); ++i) {
    const Eigen::Vector3d p = eigen(local.points[i]);
    const double u = p.dot(x), v = p.dot(y);
    Vector6 f;
    f << 1, u, v, u * u / 2, u * v, v * v / 2;
    matrix += local.weights[i] * f * f.transpose();
    right += (local.weights[i] * p.dot(n)) * f;
  }
  const Vector6 height = matrix.ldlt().solve(right);
  if (!height.allFinite()) return;
  Eigen::Matrix2d second;
  second << height(3), height(4), height(4), height(5);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> principal(second);
  for (int k = 0; k < 2; ++k) {
    const double curvature = principal.eigenvalues()(k);
    if (!(std::abs(curvature) > 1 / kLargest)) continue;
    const Eigen::Vector2d other = principal.eigenvectors().col(1 - k);
    const Eigen::Vector3d along = other(0) * x + other(1) * y, centre = (height(0) + 1 / curvature) * n;
    for (const double angle : slopes)
      axes.push_back({vec3(centre), vec3(std::cos(angle) * along + std::sin(angle) * n)});
  }
}

std::optional<Shape> start_cylinder(const Local& local, const Vec3& axis) {
  const auto [u, v] = frame_across(axis);
  RoundFitter<2> circle;
  for (std::size_t i = 0; i < local.points.size(); ++i)
    circle.add({dot(u, local.points[i]), dot(v, local.points[i])}, local.weights[i]);
  const RoundFit<2> fit = circle.fit();
  if (!(fit.radius > 0)) return std::nullopt;
  return Shape{SurfaceType::cylinder, fit.centre(0) * u + fit.centre(1) * v, axis, fit.radius};
}

// Half planes through the axis have coordinates (distance to the axis, along the axis).
std::optional<Shape> start_cone(const Local& local, const Vec3& axis, const Vec3& point) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < local.points.size(); ++i) {
    const Vec3 q = local.points[i] - point;
    const Eigen::Vector2d x(norm(cross(axis, q)), dot(axis, q));
    mean += local.weights[i] * x;
    second += local.weights[i] * x * x.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(second - mean * mean.transpose());
  Eigen::Vector2d line = solver.eigenvectors().col(1);
  if (line(0) < 0) line = -line;
  Shape cone{SurfaceType::cone, point, axis};
  cone.angle = std::atan2(line(0), std::abs(line(1)));
  if (line(1) < 0) cone.axis = -axis;
  cone.radius = mean(0) * std::cos(cone.angle) - (line(1) < 0 ? -mean(1) : mean(1)) * std::sin(cone.angle);
  return cone;
}

// The point nearest to all tangent planes: data on both nappes of a cone are no trouble to it.
Vec3 apex_point(const Sums& sums) {
  const Eigen::Matrix3d regular = sums.normals + 1e-9 * Eigen::Matrix3d::Identity();
  return vec3(regular.inverse() * sums.offset);
}

std::optional<Shape> start_cone_at_apex(const Local& local, const Vec3& axis, const Vec3& apex) {
  double rho = 0, along = 0;
  for (std::size_t i = 0; i < local.points.size(); ++i) {
    const Vec3 q = local.points[i] - apex;
    rho += local.weights[i] * norm(cross(axis, q));
    along += local.weights[i] * std::abs(dot(axis, q));
  }
  // The points' centroid is the origin.
  Shape cone{SurfaceType::cone, apex, dot(axis, apex) > 0 ? -axis : axis};
  cone.angle = std::atan2(rho, along);
  return cone;
}

std::optional<Shape> start_torus(const Local& local, const Vec3& axis, const Vec3& point) {
  RoundFitter<2> circle;
  for (std::size_t i = 0; i < local.points.size(); ++i) {
    const Vec3 q = local.points[i] - point;
    circle.add({norm(cross(axis, q)), dot(axis, q)}, local.weights[i]);
  }
  const RoundFit<2> fit = circle.fit();
  if (!(fit.radius > 0) || fit.radius > 10 * kLargest) return std::nullopt;
  return Shape{SurfaceType::torus, point + fit.centre(1) * axis, axis, std::max(fit.centre(0), 1.05 * fit.radius),
               fit.radius};
}

std::optional<Shape> start_sphere(const Local& local) {
  RoundFitter<3> sphere;
  for (std::size_t i = 0; i < local.points.size(); ++i) sphere.add(eigen(local.points[i]), local.weights[i]);
  const RoundFit<3> fit = sphere.fit();
  if (!(fit.radius > 0)) return std::nullopt;
  return Shape{SurfaceType::sphere, vec3(fit.centre), {0, 0, 1}, fit.radius};
}

std::vector<Shape> starts(SurfaceType type, const Local& local) {
  std::vector<Shape> result;
  const auto add = [&](std::optional<Shape> shape) {
    if (shape && normalise(*shape)) result.push_back(*shape);
  };
  if (type == SurfaceType::sphere) {
    add(start_sphere(local));
    return result;
  }
  const Sums sums(local);
  std::vector<Axis> axes;
  for (const Vec3& direction : axis_directions(sums)) {
    axes.push_back({axis_point(sums, direction), direction});
    if (type == SurfaceType::cone) add(start_cone_at_apex(local, direction, apex_point(sums)));
  }
  if (type == SurfaceType::cone) add_axes_by_curvature(local, sums, {-1.2, -0.8, -0.3, 0.3, 0.8, 1.2}, axes);
  if (type == SurfaceType::torus) add_axes_by_curvature(local, sums, {0, pi / 4, pi / 2, -pi / 4}, axes);
  for (const Axis& axis : axes) {
    if (type == SurfaceType::cylinder) add(start_cylinder(local, axis.direction));
    if (type == SurfaceType::cone) add(start_cone(local, axis.direction, axis.point));
    if (type == SurfaceType::torus) add(start_torus(local, axis.direction, axis.point));
  }
  return result;
}

struct Fitted {
  Shape shape;
  NormalEquations equations;
};

// The best of the starts' descents on a part of the samples, taken to its end on all of them.
std::optional<Fitted> best_of(std::vector<Shape> candidates, const Local& local, const Local& thin) {
  std::vector<std::pair<double, Shape>> ranked;
  for (const Shape& shape : candidates) {
    const double e = energy(shape, thin);
    if (std::isfinite(e)) ranked.emplace_back(e, shape);
  }
  if (ranked.empty()) return std::nullopt;
  const auto less = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::stable_sort(ranked.begin(), ranked.end(), less);
  if (ranked.size() > kTried) ranked.resize(kTried);
  if (ranked.size() > 1)
    for (auto& [e, shape] : ranked) {
      e = descend(shape, thin, kFirstSteps).energy;
      if (e < kExact) break;
    }
  Fitted fitted{std::min_element(ranked.begin(), ranked.end(), less)->second, {}};
  fitted.equations = descend(fitted.shape, local, kSteps);
  return fitted;
}

std::optional<Fitted> best_of(SurfaceType type, const Local& local) {
  const Local thin = thinned(local);
  return best_of(starts(type, thin), local, thin);
}

// The best plane through the samples' centroid.
struct FlatFit {
  Vec3 normal;
  double energy;
  bool determined;
};

FlatFit best_plane(const Local& local) {
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < local.points.size(); ++i)
    second += local.weights[i] * eigen(local.points[i]) * eigen(local.points[i]).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(second);
  FlatFit plane{vec3(solver.eigenvectors().col(0)), 0, solver.eigenvalues()(1) > kLeastPivot * solver.eigenvalues()(2)};
  double side = 0;
  for (std::size_t i = 0; i < local.points.size(); ++i) {
    const double d = dot(local.points[i], plane.normal);
    plane.energy += local.weights[i] * d * d;
    side += local.weights[i] * dot(local.normals[i], plane.normal);
  }
  if (side < 0) plane.normal = -plane.normal;
  return plane;
}

bool determined(const NormalEquations& equations) {
  const Vector pivots = equations.matrix.ldlt().vectorD().cwiseAbs();
  return pivots.minCoeff() > kLeastPivot * pivots.maxCoeff();
}

// Whether a surface with more unknowns is no better than a special case of it, by the variance left over.
bool as_good(double simpler, SurfaceType simpler_type, double energy, SurfaceType type, std::size_t count) {
  if (simpler < kExact) return true;
  const double n = static_cast<double>(count);
  const auto freedom = [&](SurfaceType t) { return std::max(1.0, n - unknowns(t)); };
  return energy / freedom(type) > std::max(0.5, 1 - kGain / n) * simpler / freedom(simpler_type);
}

bool has_simpler(const Fitted& fitted, const Local& local) {
  const Shape& shape = fitted.shape;
  const auto beaten_by = [&](double simpler, SurfaceType type) {
    return as_good(simpler, type, fitted.equations.energy, shape.type, local.points.size());
  };
  const auto beaten_by_fit = [&](const std::optional<Fitted>& simpler) {
    return simpler && determined(simpler->equations) && beaten_by(simpler->equations.energy, simpler->shape.type);
  };
  if (beaten_by(best_plane(local).energy, SurfaceType::plane)) return true;
  if (shape.type == SurfaceType::cone) {
    Shape cylinder{SurfaceType::cylinder, shape.centre, shape.axis, shape.radius / shape.cosine};
    return normalise(cylinder) && beaten_by_fit(best_of({cylinder}, local, local));
  }
  if (shape.type != SurfaceType::torus) return false;
  if (beaten_by_fit(best_of(SurfaceType::sphere, local))) return true;
  constexpr double kLarge = 10;
  return shape.radius > kLarge &&
         (beaten_by_fit(best_of(SurfaceType::cylinder, local)) || beaten_by_fit(best_of(SurfaceType::cone, local)));
}

// Share of the weight before a cone's apex.
double before_apex(const Shape& shape, const Local& local) {
  double share = 0;
  for (std::size_t i = 0; i < local.points.size(); ++i)
    if (shape.radius + dot(local.points[i] - shape.centre, shape.axis) * shape.sine < 0) share += local.weights[i];
  return share;
}

bool acceptable(const Shape& shape, const Local& local) {
  switch (shape.type) {
    case SurfaceType::cone:
      return shape.angle > kLeastAngle && shape.angle < pi / 2 - kLeastAngle &&
             std::abs(shape.radius) / shape.sine < kLargest / kLeastAngle && before_apex(shape, local) < 0.5;
    case SurfaceType::torus: return shape.radius < kLargest && shape.minor_radius < shape.radius;
    default: return shape.radius < kLargest;
  }
}

Primitive to_primitive(const Shape& shape) {
  switch (shape.type) {
    case SurfaceType::sphere: return make_sphere(shape.centre, shape.radius);
    case SurfaceType::cylinder: return make_cylinder(shape.centre, shape.axis, shape.radius);
    case SurfaceType::cone: {
      const Vec3 apex = shape.centre - (shape.radius / shape.sine) * shape.axis;
      return make_cone(apex, shape.axis, shape.angle);
    }
    default: return make_torus(shape.centre, shape.axis, shape.radius, shape.minor_radius);
  }
}

// The shape of a sphere, cylinder, cone or torus in the samples' coordinates.
std::optional<Shape> to_shape(const Primitive& primitive, const Local& local) {
  Shape shape{type_of(primitive), {}};
  const auto place = [&](const Vec3& centre) { shape.centre = (1 / local.scale) * (centre - local.origin); };
  if (const auto* sphere = std::get_if<Sphere>(&primitive)) {
    place(sphere->centre);
    shape.radius = sphere->radius / local.scale;
  } else if (const auto* cylinder = std::get_if<Cylinder>(&primitive)) {
    place(cylinder->point);
    shape.axis = cylinder->axis;
    shape.radius = cylinder->radius / local.scale;
  } else if (const auto* cone = std::get_if<Cone>(&primitive)) {
    place(cone->apex);
    shape.axis = cone->axis;
    shape.angle = cone->angle;
  } else if (const auto* torus = std::get_if<Torus>(&primitive)) {
    place(torus->centre);
    shape.axis = torus->axis;
    shape.radius = torus->radius / local.scale;
    shape.minor_radius = torus->minor_radius / local.scale;
  }
  if (!normalise(shape)) return std::nullopt;
  return shape;
}

std::optional<PrimitiveFit> checked(const std::optional<Fitted>& fitted, const Local& local,
                                    double most = std::numeric_limits<double>::infinity()) {
  if (!fitted || !acceptable(fitted->shape, local)) return std::nullopt;
  if (fitted->equations.energy * local.total * local.scale * local.scale > most) return std::nullopt;
  if (!determined(fitted->equations) || has_simpler(*fitted, local)) return std::nullopt;
  const Primitive primitive = to_primitive(fitted->shape);
  double energy = fitted->equations.energy;
  if (std::holds_alternative<Cone>(primitive)) {
    // Before the apex the other nappe is nearer than the one that was fitted.
    energy = 0;
    for (std::size_t i = 0; i < local.points.size(); ++i) {
      const double d = distance(primitive, local.points[i]);
      energy += local.weights[i] * d * d;
    }
  }
  return PrimitiveFit{from_local(primitive, local.origin, local.scale),
                      energy * local.total * local.scale * local.scale};
}

std::optional<PrimitiveFit> fit_plane_to(const Local& local) {
  const FlatFit plane = best_plane(local);
  if (!plane.determined) return std::nullopt;
  return PrimitiveFit{make_plane(plane.normal, dot(plane.normal, local.origin)),
                      plane.energy * local.total * local.scale * local.scale};
}

void require_fitted(SurfaceType type) {
  if (type > SurfaceType::torus)
    throw Error(std::string("no fit by distance of a ") + name_of(type) +
                ": give a plane, sphere, cylinder, cone or torus");
}

// Whether there are as many different points as unknowns.
bool enough(SurfaceType type, const Local& local) {
  std::vector<Vec3> distinct;
  for (const Vec3& p : local.points) {
    if (std::find(distinct.begin(), distinct.end(), p) == distinct.end()) distinct.push_back(p);
    if (distinct.size() == static_cast<std::size_t>(unknowns(type))) return true;
  }
  return false;
}

double squared_distance(const Quadric& quadric, const SurfaceSamples& samples) {
  const double second_order = second_order_of(quadric);
  double sum = 0;
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    const double d = approximate_distance(quadric, second_order, samples.points[i]);
    sum += samples.weights[i] * d * d;
  }
  return sum;
}

// The quadric of least sum of f^2 / |grad f|^2, the gradients taken from `last`, by Taubin's normalisation.
std::optional<Quadric> reweighted(const Quadric& last, const SurfaceSamples& local) {
  using Vector9 = Eigen::Matrix<double, 9, 1>;
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  double mean_slope = 0, total = 0;
  for (std::size_t i = 0; i < local.points.size(); ++i)
    mean_slope += local.weights[i] * norm2(gradient_of(last, local.points[i]));
  if (!(mean_slope > 0)) return std::nullopt;
  Matrix9 second = Matrix9::Zero(), slopes = Matrix9::Zero();
  Vector9 mean = Vector9::Zero();
  for (std::size_t i = 0; i < local.points.size(); ++i) {
    const Vec3& p = local.points[i];
    const double w = local.weights[i] / std::max(norm2(gradient_of(last, p)), 1e-3 * mean_slope);
    Vector9 f, x, y, z;
    f << p.x, p.y, p.z, p.x * p.x, p.x * p.y, p.x * p.z, p.y * p.y, p.y * p.z, p.z * p.z;
    x << 1, 0, 0, 2 * p.x, p.y, p.z, 0, 0, 0;
    y << 0, 1, 0, 0, p.x, 0, 2 * p.y, p.z, 0;
    z << 0, 0, 1, 0, 0, p.x, 0, p.y, 2 * p.z;
    total += w;
    mean += w * f;
    second += w * f * f.transpose();
    slopes += w * (x * x.transpose() + y * y.transpose() + z * z.transpose());
  }
  mean /= total;
  const Matrix9 m = second / total - mean * mean.transpose();
  const Matrix9 n = slopes / total + (1e-12 * slopes.trace() / total) * Matrix9::Identity();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix9> solver(m, n);
  if (solver.info() != Eigen::Success) return std::nullopt;
  const Vector9 c = solver.eigenvectors().col(0);
  Quadric quadric;
  quadric.c[0] = -mean.dot(c);
  for (int k = 0; k < 9; ++k) quadric.c[static_cast<std::size_t>(k) + 1] = c(k);
  return quadric;
}

}  // namespace

std::optional<PrimitiveFit> fit_primitive(SurfaceType type, const SurfaceSamples& samples, double most) {
  require_fitted(type);
  const Local local = to_local(samples);
  if (!enough(type, local)) return std::nullopt;
  if (type == SurfaceType::plane) return fit_plane_to(local);
  return checked(best_of(type, local), local, most);
}

std::optional<PrimitiveFit> refine_primitive(const Primitive& start, const SurfaceSamples& samples) {
  const SurfaceType type = type_of(start);
  require_fitted(type);
  const Local local = to_local(samples);
  if (!enough(type, local)) return std::nullopt;
  if (type == SurfaceType::plane) return fit_plane_to(local);
  const std::optional<Shape> shape = to_shape(start, local);
  if (!shape) return std::nullopt;
  return checked(best_of({*shape}, local, local), local);
}

PrimitiveFit refine_quadric(const Primitive& start, const SurfaceSamples& samples) {
  constexpr int kReweightings = 10;
  const Local local = to_local(samples);
  PrimitiveFit best{start, 0};
  const std::optional<Quadric> first = quadric_of(start);
  if (!first || !(local.scale > 0)) {
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
      const double d = distance(start, samples.points[i]);
      best.squared_distance += samples.weights[i] * d * d;
    }
    return best;
  }
  const SurfaceSamples scaled{local.points, local.normals, local.weights};
  Quadric quadric = bisector::to_local(*first, local.origin, local.scale);
  const double before = squared_distance(quadric, scaled);
  double least = before;
  Quadric kept = quadric;
  for (int i = 0; i < kReweightings; ++i) {
    const std::optional<Quadric> next = reweighted(quadric, scaled);
    if (!next) break;
    quadric = *next;
    const double d = squared_distance(quadric, scaled);
    if (d < least) kept = quadric;
    if (!(d < (1 - 1e-6) * least)) break;
    least = d;
  }
  if (least < before)
    best.primitive = classify(from_local(kept, local.origin, local.scale), local.origin, local.scale, 0);
  best.squared_distance = least * local.total * local.scale * local.scale;
  return best;
}

}  // namespace bisector
