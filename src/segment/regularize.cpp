#include "segment/regularize.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <utility>

#include "core/grouping.h"
#include "segment/border_weights.h"
#include "segment/primitive.h"
#include "segment/proxy.h"

namespace bisector {
namespace {

using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double kLeastNoise = 1e-7;       // of distances in the unit-sized model: single precision's
constexpr std::size_t kEnoughInside = 24;  // vertices inside a region, without which those on its border count too
constexpr int kSteps = 30;                 // of Levenberg and Marquardt
constexpr int kRounds = 30;                // of Newton, for right angles
constexpr double kRight = 1e-15;           // cosine of a right angle

// What a fit may change: rotations about u and v, translations along u, v and the axis, radius, minor radius or angle.
enum Column { turn_u, turn_v, along_u, along_v, along_axis, radius, second, columns };
using Held = std::array<bool, columns>;

struct Samples {
  std::vector<Vec3> points;
  std::vector<double> weights;  // of sum 1
  Vec3 centroid;
};

// A surface with the parameters that fits move.
struct Shape {
  SurfaceType type = SurfaceType::plane;
  Vec3 point, axis{0, 0, 1}, u, v;  // a point of the plane or the axis, the centre or apex; an orthonormal frame
  double radius = 0, second = 0;    // second: a torus' minor radius, a cone's angle
};

std::optional<Shape> shape_of(const Primitive& primitive) {
  Shape shape;
  shape.type = type_of(primitive);
  if (const auto* plane = std::get_if<Plane>(&primitive)) {
    shape.point = plane->offset * plane->normal;
    shape.axis = plane->normal;
  } else if (const auto* sphere = std::get_if<Sphere>(&primitive)) {
    shape.point = sphere->centre;
    shape.radius = sphere->radius;
  } else if (const auto* cylinder = std::get_if<Cylinder>(&primitive)) {
    shape.point = cylinder->point;
    shape.axis = cylinder->axis;
    shape.radius = cylinder->radius;
  } else if (const auto* cone = std::get_if<Cone>(&primitive)) {
    shape.point = cone->apex;
    shape.axis = cone->axis;
    shape.second = cone->angle;
  } else if (const auto* torus = std::get_if<Torus>(&primitive)) {
    shape.point = torus->centre;
    shape.axis = torus->axis;
    shape.radius = torus->radius;
    shape.second = torus->minor_radius;
  } else {
    return std::nullopt;
  }
  std::tie(shape.u, shape.v) = frame_across(shape.axis);
  return shape;
}

Primitive primitive_of(const Shape& shape) {
  switch (shape.type) {
    case SurfaceType::plane: return make_plane(shape.axis, dot(shape.axis, shape.point));
    case SurfaceType::sphere: return make_sphere(shape.point, shape.radius);
    case SurfaceType::cylinder: return make_cylinder(shape.point, shape.axis, shape.radius);
    case SurfaceType::cone: return make_cone(shape.point, shape.axis, shape.second);
    default: return make_torus(shape.point, shape.axis, shape.radius, shape.second);
  }
}

bool is_possible(const Shape& s) {
  const bool finite = std::isfinite(norm2(s.point) + norm2(s.axis) + s.radius + s.second);
  switch (s.type) {
    case SurfaceType::plane: return finite;
    case SurfaceType::cone: return finite && s.second > 0 && s.second < pi / 2;
    case SurfaceType::torus: return finite && s.second > 0 && s.second < s.radius;
    default: return finite && s.radius > 0;
  }
}

bool has_axis(const Shape& s) { return s.type != SurfaceType::sphere && s.type != SurfaceType::plane; }

bool is_free(SurfaceType type, Column column) {
  switch (column) {
    case turn_u:
    case turn_v: return type != SurfaceType::sphere;
    case along_u:
    case along_v: return type != SurfaceType::plane;
    case along_axis: return type != SurfaceType::cylinder;
    case radius: return type == SurfaceType::sphere || type == SurfaceType::cylinder || type == SurfaceType::torus;
    default: return type == SurfaceType::cone || type == SurfaceType::torus;
  }
}

// Signed distance, the unit normal at the foot, and derivatives by the two sizes.
struct Residual {
  double d;
  Vec3 normal;
  double by_radius = 0, by_second = 0;
};

Residual residual(const Shape& shape, const Vec3& p) {
  const Vec3 q = p - shape.point;
  const double z = dot(shape.axis, q);
  if (shape.type == SurfaceType::plane) return {z, shape.axis};
  if (shape.type == SurfaceType::sphere) {
    const double length = norm(q);
    return {length - shape.radius, length > 0 ? (1 / length) * q : shape.axis, -1};
  }
  Vec3 out = q - z * shape.axis;
  const double rho = norm(out);
  if (rho > 0) out *= 1 / rho;
  if (shape.type == SurfaceType::cylinder) return {rho - shape.radius, out, -1};
  if (shape.type == SurfaceType::cone) {
    const double sine = std::sin(shape.second), cosine = std::cos(shape.second);
    return {rho * cosine - z * sine, cosine * out - sine * shape.axis, 0, -rho * sine - z * cosine};
  }
  const double beyond = rho - shape.radius, length = std::hypot(beyond, z);
  const double cosine = length > 0 ? beyond / length : 0, sine = length > 0 ? z / length : 0;
  return {length - shape.second, cosine * out + sine * shape.axis, -cosine, -1};
}

// A region's surface while it is regularized.
struct Member {
  std::vector<Index> regions;  // several are of one plane
  Shape shape;
  Samples samples;
  double count = 0;     // of independent samples
  double variance = 0;  // of their distances
  double best = 0;      // mean square distance without constraints
  Held held{};
  int constraints = 0;  // parameters given up
  bool place = true;    // may share its axis' place

  std::vector<Column> free() const {
    std::vector<Column> result;
    for (int c = 0; c < columns; ++c)
      if (is_free(shape.type, static_cast<Column>(c)) && !held[static_cast<std::size_t>(c)])
        result.push_back(static_cast<Column>(c));
    return result;
  }
};

double mean_square(const Shape& shape, const Samples& samples) {
  double sum = 0;
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    const double d = residual(shape, samples.points[i]).d;
    sum += samples.weights[i] * d * d;
  }
  return sum;
}

struct Equations {
  MatrixXd matrix;
  VectorXd right;
};

Equations equations_of(const Member& member, const std::vector<Column>& free) {
  const Shape& s = member.shape;
  const auto n = static_cast<Eigen::Index>(free.size());
  Equations e{MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  VectorXd j(n);
  for (std::size_t i = 0; i < member.samples.points.size(); ++i) {
    const Vec3& p = member.samples.points[i];
    const Residual r = residual(s, p);
    const Vec3 moment = cross(p - member.samples.centroid, r.normal);
    for (Eigen::Index k = 0; k < n; ++k) switch (free[static_cast<std::size_t>(k)]) {
        case turn_u: j(k) = -dot(moment, s.u); break;
        case turn_v: j(k) = -dot(moment, s.v); break;
        case along_u: j(k) = -dot(r.normal, s.u); break;
        case along_v: j(k) = -dot(r.normal, s.v); break;
        case along_axis: j(k) = -dot(r.normal, s.axis); break;
        case radius: j(k) = r.by_radius; break;
        default: j(k) = r.by_second;
      }
    e.matrix += member.samples.weights[i] * j * j.transpose();
    e.right -= (member.samples.weights[i] * r.d) * j;
  }
  return e;
}

// Turns a shape about a point; its frame goes with it.
void turn(Shape& shape, const Vec3& about, const Vec3& w) {
  shape.point = about + rotated(shape.point - about, w);
  shape.axis = rotated(shape.axis, w);
  shape.axis *= 1 / norm(shape.axis);
  std::tie(shape.u, shape.v) = frame_across(shape.axis);
}

Shape stepped(const Member& member, const std::vector<Column>& free, const VectorXd& step) {
  Shape next = member.shape;
  Vec3 w, move;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const double x = step(static_cast<Eigen::Index>(k));
    switch (free[k]) {
      case turn_u: w += x * member.shape.u; break;
      case turn_v: w += x * member.shape.v; break;
      case along_u: move += x * member.shape.u; break;
      case along_v: move += x * member.shape.v; break;
      case along_axis: move += x * member.shape.axis; break;
      case radius: next.radius += x; break;
      default: next.second += x;
    }
  }
  if (norm2(w) > 0) turn(next, member.samples.centroid, w);
  next.point += move;
  return next;
}

// Levenberg-Marquardt over what is not held; the mean square distance.
double refit(Member& member) {
  const std::vector<Column> free = member.free();
  double energy = mean_square(member.shape, member.samples), damping = 1e-4;
  if (free.empty()) return energy;
  for (int step = 0; step < kSteps && damping < 1e8;) {
    const Equations e = equations_of(member, free);
    MatrixXd damped = e.matrix;
    damped.diagonal() += (damping * e.matrix.diagonal()).cwiseMax(1e-30);
    const VectorXd x = damped.ldlt().solve(e.right);
    const Shape next = stepped(member, free, x);
    ++step;
    const double there = x.allFinite() && is_possible(next) ? mean_square(next, member.samples) : energy;
    if (!(there < energy)) {
      damping = std::max(1e-6, 10 * damping);
      continue;
    }
    const bool done = energy - there < 1e-10 * energy;
    member.shape = next;
    energy = there;
    damping *= 0.1;
    if (done) break;
  }
  return energy;
}

// Covariance of two of the free parameters or of one, the others free too; directions that the data leave open have a
// variance of about one.
MatrixXd covariance(const Member& member, const std::vector<Column>& of) {
  const std::vector<Column> free = member.free();
  MatrixXd information = equations_of(member, free).matrix * (member.count / member.variance);
  information += MatrixXd::Identity(information.rows(), information.cols());  // nothing is known worse than that
  const MatrixXd all = information.ldlt().solve(MatrixXd::Identity(information.rows(), information.cols()));
  const auto n = static_cast<Eigen::Index>(of.size());
  MatrixXd result(n, n);
  const auto at = [&](Column c) {
    return static_cast<Eigen::Index>(std::find(free.begin(), free.end(), c) - free.begin());
  };
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      result(i, j) = all(at(of[static_cast<std::size_t>(i)]), at(of[static_cast<std::size_t>(j)]));
  return result;
}

// --- Groups of equal values ---

// A value of one or two numbers that several members have, with its covariance.
struct Value {
  VectorXd mean;
  MatrixXd covariance;
  std::vector<std::size_t> items;
};

// log of how much likelier equal values are than any of `range` possible ones.
double log_factor(const VectorXd& difference, const MatrixXd& covariance, double range) {
  const double square = difference.dot(covariance.ldlt().solve(difference));
  const auto n = static_cast<double>(difference.size());
  return std::log(range) - 0.5 * (n * std::log(2 * pi) + std::log(covariance.determinant()) + square);
}

// Joins values, the likeliest pair first, while one is likelier than not among all there are.
void join_equal(std::vector<Value>& values, const std::function<double(const Value&, const Value&)>& log_likelier,
                const std::function<Value(const Value&, const Value&)>& joined) {
  const double least = std::log(static_cast<double>(std::max<std::size_t>(2, values.size())));
  while (true) {
    double best = least;
    std::size_t a = 0, b = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      for (std::size_t j = i + 1; j < values.size(); ++j) {
        const double l = log_likelier(values[i], values[j]);
        if (l > best) {
          best = l;
          a = i;
          b = j;
        }
      }
    if (b == 0) return;
    Value both = joined(values[a], values[b]);
    both.items = values[a].items;
    both.items.insert(both.items.end(), values[b].items.begin(), values[b].items.end());
    values[a] = std::move(both);
    values.erase(values.begin() + static_cast<std::ptrdiff_t>(b));
  }
}

Value weighted_mean(const Value& a, const Value& b) {
  const MatrixXd p = a.covariance.inverse(), q = b.covariance.inverse();
  Value both;
  both.covariance = (p + q).inverse();
  both.mean = a.mean + both.covariance * (q * (b.mean - a.mean));
  return both;
}

void join_equal(std::vector<Value>& values, double range) {
  join_equal(
      values,
      [&](const Value& a, const Value& b) { return log_factor(b.mean - a.mean, a.covariance + b.covariance, range); },
      weighted_mean);
}

Vec3 vec3(const VectorXd& x) { return {x(0), x(1), x(2)}; }
VectorXd vector(const Vec3& p) { return Eigen::Vector3d(p.x, p.y, p.z); }

Eigen::Matrix<double, 3, 2> frame(const Vec3& axis) {
  const auto [u, v] = frame_across(axis);
  Eigen::Matrix<double, 3, 2> f;
  f << u.x, v.x, u.y, v.y, u.z, v.z;
  return f;
}

// The value of a direction: three numbers, of covariance across it.
double log_parallel(const Value& a, const Value& b) {
  const auto f = frame(vec3(a.mean));
  const double side = a.mean.dot(b.mean) < 0 ? -1 : 1;
  const Vector2d difference = side * (f.transpose() * b.mean);
  const Matrix2d covariance = f.transpose() * (a.covariance + b.covariance) * f;
  return log_factor(difference, covariance, 2 * pi);  // directions without sign: half a sphere
}

Value joined_direction(const Value& a, const Value& b) {
  const auto f = frame(vec3(a.mean));
  const double side = a.mean.dot(b.mean) < 0 ? -1 : 1;
  const Matrix2d p = (f.transpose() * a.covariance * f).inverse(), q = (f.transpose() * b.covariance * f).inverse();
  const Matrix2d both = (p + q).inverse();
  const Vector2d x = both * (q * (side * (f.transpose() * b.mean)));
  Value result;
  result.mean = (a.mean + f * x).normalized();
  result.covariance = f * both * f.transpose();
  return result;
}

// --- Right angles ---

struct RightAngle {
  std::size_t a, b;           // directions
  double log_likelier, most;  // most: that the squares may grow by
};

std::vector<RightAngle> right_angles(const std::vector<Value>& directions) {
  std::vector<RightAngle> found;
  const double n = static_cast<double>(directions.size()), least = std::log(std::max(2.0, n * (n - 1) / 2));
  for (std::size_t i = 0; i < directions.size(); ++i)
    for (std::size_t j = i + 1; j < directions.size(); ++j) {
      const Value &a = directions[i], &b = directions[j];
      const VectorXd cosine = VectorXd::Constant(1, a.mean.dot(b.mean));
      const MatrixXd variance =
          MatrixXd::Constant(1, 1, b.mean.dot(a.covariance * b.mean) + a.mean.dot(b.covariance * a.mean));
      const double l = log_factor(cosine, variance, 2);  // cosines between random directions are spread evenly
      const double none = log_factor(VectorXd::Zero(1), variance, 2);
      if (l > least) found.push_back({i, j, l, 2 * (none - least)});
    }
  std::stable_sort(found.begin(), found.end(),
                   [](const RightAngle& p, const RightAngle& q) { return p.log_likelier > q.log_likelier; });
  return found;
}

// The nearest directions, by their covariances, with all the right angles, and the sum of squares by which they differ;
// none if there are no such.
std::optional<double> make_right(const std::vector<Value>& measured, const std::vector<RightAngle>& angles,
                                 std::vector<Vec3>& directions) {
  const std::size_t n = measured.size();
  std::vector<Vec3> d;
  for (const Value& value : measured) d.push_back(vec3(value.mean));
  double squares = 0;
  for (int round = 0; round < kRounds; ++round) {
    // With unknowns of unit covariance the least change is the shortest vector.
    std::vector<Eigen::Matrix<double, 3, 2>> spread(n);
    VectorXd back = VectorXd::Zero(static_cast<Eigen::Index>(2 * n));
    for (std::size_t i = 0; i < n; ++i) {
      const auto f = frame(d[i]);
      const auto g = frame(vec3(measured[i].mean));
      const Matrix2d across = g.transpose() * measured[i].covariance * g;
      const Matrix2d root = across.llt().matrixL();
      const Matrix2d turned = f.transpose() * g;  // nearly a rotation
      spread[i] = f * turned * root;
      back.segment<2>(static_cast<Eigen::Index>(2 * i)) =
          (turned * root).inverse() * (f.transpose() * vector(vec3(measured[i].mean) - d[i]));
    }
    MatrixXd rows = MatrixXd::Zero(static_cast<Eigen::Index>(angles.size()), static_cast<Eigen::Index>(2 * n));
    VectorXd right(static_cast<Eigen::Index>(angles.size()));
    double worst = 0;
    for (std::size_t k = 0; k < angles.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      const auto [a, b] = std::pair(angles[k].a, angles[k].b);
      rows.block<1, 2>(row, static_cast<Eigen::Index>(2 * a)) = vector(d[b]).transpose() * spread[a];
      rows.block<1, 2>(row, static_cast<Eigen::Index>(2 * b)) = vector(d[a]).transpose() * spread[b];
      worst = std::max(worst, std::abs(dot(d[a], d[b])));
      right(row) = -dot(d[a], d[b]);
      const double length = rows.row(row).norm();
      if (length > 0) {
        rows.row(row) /= length;
        right(row) /= length;
      }
    }
    squares = back.squaredNorm();
    if (worst <= kRight) {
      directions = d;
      return squares;
    }
    const VectorXd step = back + rows.completeOrthogonalDecomposition().solve(right - rows * back);
    for (std::size_t i = 0; i < n; ++i) {
      d[i] += vec3(spread[i] * step.segment<2>(static_cast<Eigen::Index>(2 * i)));
      d[i] *= 1 / norm(d[i]);
    }
  }
  return std::nullopt;
}

// --- The stages ---

class Regularizer {
 public:
  explicit Regularizer(std::vector<Member> all) : members(std::move(all)) {}

  std::vector<Member> members;
  std::vector<SegmentRelation> relations;

  void run() {
    share_directions();
    refit_all();
    share_places();
    refit_all();
    share_sizes();
    refit_all();
  }

  // The member whose squares have grown the most beyond what fewer parameters explain (Schwarz 1978); none: all are
  // fine.
  std::optional<std::size_t> strained() const {
    std::optional<std::size_t> worst;
    double most = 1;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const Member& m = members[i];
      if (m.constraints == 0) continue;
      if (!is_possible(m.shape)) return i;
      const double growth = (mean_square(m.shape, m.samples) - m.best) * m.count / m.variance;
      const double share = growth / (m.constraints * std::log(std::max(10.0, m.count)));
      if (!(share <= most)) {
        most = share;
        worst = i;
      }
    }
    return worst;
  }

  bool shares_place(std::size_t member) const {
    return has_axis(members[member].shape) && members[member].held[along_u];
  }

 private:
  void refit_all() {
    for (Member& m : members)
      if (m.constraints > 0) refit(m);
  }

  void hold(Member& m, std::initializer_list<Column> which) {
    for (const Column c : which) {
      if (!std::exchange(m.held[c], true)) ++m.constraints;
    }
  }

  std::vector<Index> regions_of(const std::vector<std::size_t>& items) const {
    std::vector<Index> regions;
    for (const std::size_t i : items)
      regions.insert(regions.end(), members[i].regions.begin(), members[i].regions.end());
    std::sort(regions.begin(), regions.end());
    return regions;
  }

  void share_directions() {
    std::vector<Value> directions;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const Member& m = members[i];
      if (m.shape.type == SurfaceType::sphere) continue;
      // A turn about u moves the axis towards -v, one about v towards u.
      Eigen::Matrix<double, 3, 2> f;
      f.col(0) = -vector(m.shape.v);
      f.col(1) = vector(m.shape.u);
      directions.push_back({vector(m.shape.axis), f * covariance(m, {turn_u, turn_v}) * f.transpose(), {i}});
    }
    join_equal(directions, log_parallel, joined_direction);
    std::vector<Vec3> axes;
    for (const Value& value : directions) axes.push_back(vec3(value.mean));
    std::vector<RightAngle> kept;
    double squares = 0;
    for (const RightAngle& angle : right_angles(directions)) {
      kept.push_back(angle);
      std::vector<Vec3> next;
      const std::optional<double> there = make_right(directions, kept, next);
      if (there && *there - squares <= angle.most) {
        squares = *there;
        axes = next;
      } else {
        kept.pop_back();
      }
    }
    std::vector<char> right(directions.size(), 0);
    for (const RightAngle& angle : kept) right[angle.a] = right[angle.b] = 1;
    for (std::size_t k = 0; k < directions.size(); ++k) {
      if (std::vector<Index> regions = regions_of(directions[k].items); regions.size() > 1)
        relations.push_back({RelationKind::parallel, std::move(regions), {}, 0});
      if (directions[k].items.size() < 2 && !right[k]) continue;
      for (const std::size_t i : directions[k].items) {
        Member& m = members[i];
        const Vec3 axis = dot(m.shape.axis, axes[k]) < 0 ? -axes[k] : axes[k];
        const Vec3 w = cross(m.shape.axis, axis);
        turn(m.shape, m.samples.centroid, w);
        m.shape.axis = axis;
        std::tie(m.shape.u, m.shape.v) = frame_across(axes[k]);
        hold(m, {turn_u, turn_v});
      }
      groups_.push_back({axes[k], directions[k].covariance, directions[k].items});
    }
    for (const RightAngle& angle : kept)
      relations.push_back({RelationKind::perpendicular, regions_of(directions[angle.a].items),
                           regions_of(directions[angle.b].items), 0});
  }

  void share_places() {
    for (const Group& group : groups_) {
      std::vector<Value> axes;
      const auto f = frame(group.axis);
      const auto [u, v] = frame_across(group.axis);
      for (const std::size_t i : group.items) {
        const Member& m = members[i];
        if (!has_axis(m.shape) || !m.place) continue;
        axes.push_back(
            {Vector2d(dot(m.shape.point, u), dot(m.shape.point, v)), covariance(m, {along_u, along_v}), {i}});
      }
      // How far an axis is off where another surface is depends on its direction, too.
      const Matrix2d tilt = f.transpose() * group.covariance * f;
      const auto height = [&](const Value& value) {
        return dot(members[value.items.front()].samples.centroid, group.axis);
      };
      join_equal(
          axes,
          [&](const Value& a, const Value& b) {
            const double apart = height(a) - height(b);
            return log_factor(b.mean - a.mean, a.covariance + b.covariance + apart * apart * tilt, 1);
          },
          weighted_mean);
      for (const Value& value : axes) {
        if (value.items.size() < 2) continue;
        for (const std::size_t i : value.items) {
          Shape& shape = members[i].shape;
          shape.point = value.mean(0) * u + value.mean(1) * v + dot(shape.point, group.axis) * group.axis;
          hold(members[i], {along_u, along_v});
        }
        relations.push_back({RelationKind::coaxial, regions_of(value.items), {}, 0});
      }
    }
  }

  struct Size {
    std::size_t member;
    Column column;
  };

  void share_sizes() {
    std::vector<Size> radii, angles;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const SurfaceType type = members[i].shape.type;
      if (is_free(type, radius)) radii.push_back({i, radius});
      if (is_free(type, second)) (type == SurfaceType::cone ? angles : radii).push_back({i, second});
    }
    // Radii are as likely to be anything up to the model's size, angles up to a right one.
    share_sizes(radii, 1, RelationKind::equal_radius);
    share_sizes(angles, pi / 2, RelationKind::equal_angle);
  }

  void share_sizes(const std::vector<Size>& sizes, double range, RelationKind kind) {
    std::vector<Value> values;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      const Member& m = members[sizes[k].member];
      const double value = sizes[k].column == radius ? m.shape.radius : m.shape.second;
      values.push_back({VectorXd::Constant(1, value), covariance(m, {sizes[k].column}), {k}});
    }
    join_equal(values, range);
    for (const Value& value : values) {
      if (value.items.size() < 2) continue;
      std::vector<std::size_t> items;
      for (const std::size_t k : value.items) {
        Member& m = members[sizes[k].member];
        (sizes[k].column == radius ? m.shape.radius : m.shape.second) = value.mean(0);
        hold(m, {sizes[k].column});
        items.push_back(sizes[k].member);
      }
      relations.push_back({kind, regions_of(items), {}, value.mean(0)});
    }
  }

  struct Group {
    Vec3 axis;
    MatrixXd covariance;
    std::vector<std::size_t> items;
  };
  std::vector<Group> groups_;  // members of one direction that is held
};

// --- Data ---

// The vertices inside a region, or all of its if those are few.
Samples samples_of(const SegmentDomain& domain, const Index* begin, const Index* end,
                   const std::vector<char>& on_border) {
  std::vector<std::pair<Index, double>> corners;
  for (const Index* t = begin; t != end; ++t)
    for (const Index v : domain.triangles[*t]) corners.push_back({v, domain.areas[*t]});
  std::stable_sort(corners.begin(), corners.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const bool inside : {true, false}) {
    Samples samples;
    Index last = kNone;
    for (const auto& [v, area] : corners) {
      if ((inside && on_border[v]) || !(area > 0)) continue;
      if (v != last) {
        samples.points.push_back(domain.vertices[v]);
        samples.weights.push_back(0);
        last = v;
      }
      samples.weights.back() += area;
    }
    if (inside && samples.points.size() < kEnoughInside) continue;
    double sum = 0;
    for (const double w : samples.weights) sum += w;
    for (std::size_t i = 0; i < samples.weights.size(); ++i) {
      samples.weights[i] /= sum;
      samples.centroid += samples.weights[i] * samples.points[i];
    }
    return samples;
  }
  return {};
}

std::vector<char> border_vertices(const SegmentDomain& domain, const std::vector<Index>& labels) {
  std::vector<Index> region(domain.vertices.size(), kNone);
  std::vector<char> on_border(domain.vertices.size(), 0);
  for (std::size_t t = 0; t < labels.size(); ++t)
    for (const Index v : domain.triangles[t]) {
      if (region[v] != kNone && region[v] != labels[t]) on_border[v] = 1;
      region[v] = labels[t];
    }
  return on_border;
}

std::vector<Member> make_members(const SegmentDomain& domain, const std::vector<Index>& labels,
                                 const std::vector<Primitive>& primitives) {
  std::vector<Proxy> proxies;
  for (const Primitive& p : primitives) proxies.push_back(Proxy::of(p));
  const std::vector<RegionNoise> noise = region_noise(domain, labels, proxies);
  const Csr<Index> triangles = items_of_labels<Index>(labels, primitives.size());
  const std::vector<char> on_border = border_vertices(domain, labels);
  std::vector<Member> members;
  for (Index r = 0; r < primitives.size(); ++r) {
    const std::optional<Shape> shape = shape_of(primitives[r]);
    if (!shape || !(noise[r].alike_area > 0)) continue;
    Member m{{r}, *shape, samples_of(domain, triangles.begin(r), triangles.end(r), on_border), 0, 0, 0, {}, 0};
    m.best = refit(m);
    const double unknowns = static_cast<double>(m.free().size());
    m.count = static_cast<double>(m.samples.points.size());
    if (m.best > kLeastNoise * kLeastNoise) m.count = std::min(m.count, noise[r].area / noise[r].alike_area);
    if (m.count <= unknowns) continue;
    m.variance = std::max(m.best * m.count / (m.count - unknowns), kLeastNoise * kLeastNoise);
    members.push_back(std::move(m));
  }
  return members;
}

// Two planes' data as one's, each point weighted by what it tells.
Member united(const Member& a, const Member& b) {
  Member both = a;
  both.regions.insert(both.regions.end(), b.regions.begin(), b.regions.end());
  const double of_a = a.count / a.variance, of_b = b.count / b.variance, sum = of_a + of_b;
  for (double& w : both.samples.weights) w *= of_a / sum;
  for (std::size_t i = 0; i < b.samples.points.size(); ++i) {
    both.samples.points.push_back(b.samples.points[i]);
    both.samples.weights.push_back(of_b / sum * b.samples.weights[i]);
  }
  both.samples.centroid = (of_a / sum) * a.samples.centroid + (of_b / sum) * b.samples.centroid;
  both.count = a.count + b.count;
  both.variance = both.count / sum;
  both.best = refit(both);
  return both;
}

// Makes one of planes whose data a common plane fits as well, up to the three parameters it saves (Schwarz 1978).
void unite_planes(std::vector<Member>& members, std::vector<SegmentRelation>& relations) {
  for (std::size_t i = 0; i < members.size(); ++i)
    for (std::size_t j = i + 1; j < members.size();) {
      const Member &a = members[i], &b = members[j];
      if (a.shape.type == SurfaceType::plane && b.shape.type == SurfaceType::plane) {
        Member both = united(a, b);
        const double growth =
            both.best * both.count / both.variance - a.best * a.count / a.variance - b.best * b.count / b.variance;
        if (growth <= 3 * std::log(both.count)) {
          members[i] = std::move(both);
          members.erase(members.begin() + static_cast<std::ptrdiff_t>(j));
          j = i + 1;
          continue;
        }
      }
      ++j;
    }
  for (Member& m : members) {
    if (m.regions.size() < 2) continue;
    std::sort(m.regions.begin(), m.regions.end());
    relations.push_back({RelationKind::coplanar, m.regions, {}, 0});
  }
}

// Sets what a member shares; surfaces that share nothing stay as they are.
void write(const Member& member, std::vector<Primitive>& primitives) {
  if (member.constraints > 0 || member.regions.size() > 1)
    for (const Index r : member.regions) primitives[r] = primitive_of(member.shape);
}

}  // namespace

std::vector<SegmentRelation> regularize(const SegmentDomain& domain, const std::vector<Index>& labels,
                                        std::vector<Primitive>& primitives) {
  std::vector<Member> members = make_members(domain, labels, primitives);
  std::vector<SegmentRelation> relations;
  unite_planes(members, relations);
  while (true) {
    Regularizer regularizer(members);
    regularizer.run();
    if (const std::optional<std::size_t> worst = regularizer.strained()) {
      // A place held on an axis of slightly wrong direction may be what strains it.
      if (regularizer.shares_place(*worst)) {
        members[*worst].place = false;
      } else {
        write(members[*worst], primitives);
        members.erase(members.begin() + static_cast<std::ptrdiff_t>(*worst));
      }
      continue;
    }
    for (const Member& m : regularizer.members) write(m, primitives);
    relations.insert(relations.end(), regularizer.relations.begin(), regularizer.relations.end());
    for (SegmentRelation& relation : relations)
      if (relation.kind == RelationKind::equal_radius) relation.value *= domain.scale;
    return relations;
  }
}

const char* name_of(RelationKind kind) {
  switch (kind) {
    case RelationKind::parallel: return "parallel";
    case RelationKind::perpendicular: return "perpendicular";
    case RelationKind::coaxial: return "coaxial";
    case RelationKind::coplanar: return "coplanar";
    case RelationKind::equal_radius: return "equal_radius";
    default: return "equal_angle";
  }
}

}  // namespace bisector
