#include "tree/tube_fit.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tree/polyline.h"

namespace bisector {
namespace {

// Stations: the points of the axis that are fitted.
constexpr double kStationPoints = 10;  // points of the scan between two, about
constexpr double kLongest = 1.5;       // distance of two in the branch's thickness, where points are few
constexpr std::size_t kMostStations = 120;
constexpr std::size_t kLeastPoints = 6;  // of the scan, for a fit

// Steps.
constexpr int kCentringSteps = 2;  // to the middle of the points
constexpr int kSteps = 6;          // of Gauss and Newton
constexpr std::size_t kStray = 4;  // segments that a foot may move along the axis in a step

// Weights, relative to one point of the scan at a station.
constexpr double kTukey = 4.7;          // residuals beyond so many standard deviations do not count
constexpr double kAxisStiffness = 2;    // of the axis' second differences
constexpr double kRadiusStiffness = 1;  // of the radius' second differences
constexpr double kRadiusSlope = 0.02;   // of the radius' first differences
constexpr double kLeastSupport = 1;     // points that a station counts as having, at least, for smoothness
constexpr double kCentring = 0.2;       // pull to the middle of the points, times the 4th power of residuals in radii
constexpr double kLeastCentring = 0.001, kMostCentring = 1;

// The largest radius, in the spread of points about their middle: that of a third of a circle where the points are near
// the surface, that of less than half of one where they are a cloud.
constexpr double kLargestRing = 1.9, kLargestCloud = 1.15;
constexpr double kRing = 0.2,
                 kCloud = 0.35;  // rms distance from the surface, in the spread, up to and from which they are so

constexpr double kLeastRadius = 0.3;  // of the noisy surface's

// Sums of squares of linear forms of few unknowns, as the normal equations of least squares.
class NormalEquations {
 public:
  explicit NormalEquations(std::size_t unknowns) : right_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(unknowns))) {}

  // weight * (sum of coefficients * unknowns - value)^2
  template <std::size_t n>
  void add(const std::array<std::size_t, n>& unknowns, const std::array<double, n>& coefficients, double value,
           double weight) {
    for (std::size_t i = 0; i < n; ++i) {
      if (coefficients[i] == 0) continue;
      const auto row = static_cast<Eigen::Index>(unknowns[i]);
      right_[row] += weight * coefficients[i] * value;
      for (std::size_t j = 0; j < n; ++j)
        if (coefficients[j] != 0)
          entries_.emplace_back(row, static_cast<Eigen::Index>(unknowns[j]),
                                weight * coefficients[i] * coefficients[j]);
    }
  }

  // False if the matrix is singular.
  bool solve(Eigen::VectorXd& x) const {
    Eigen::SparseMatrix<double> matrix(right_.size(), right_.size());
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
    if (solver.info() != Eigen::Success) return false;
    x = solver.solve(right_);
    return x.allFinite();
  }

 private:
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd right_;
};

class TubeFit {
 public:
  TubeFit(const std::vector<Vec3>& points, const std::vector<Vec3>& line, double noise)
      : points_(points), noise_(noise) {
    std::vector<double> distances;
    for (const Vec3& p : points) distances.push_back(nearest_on_polyline(line, p).distance);
    const double length = polyline_length(line);
    spread_ = std::max({quantile(std::move(distances), 0.5), 0.5 * noise, 1e-3 * length});
    const double thick = std::max(spread_, 2 * noise);
    const double step =
        std::clamp(kStationPoints * length / static_cast<double>(points.size() + 1), thick, kLongest * thick);
    const double segments = std::clamp(length / std::max(step, 1e-9), 1.0, double{kMostStations});
    tube_.axis = resample_polyline(line, static_cast<std::size_t>(segments) + 1);
    tube_.radii.assign(tube_.axis.size(), spread_);
    tube_.support.assign(tube_.axis.size(), 0);
    stations_.resize(tube_.axis.size());
  }

  // Towards the middle of the points.
  void centre() {
    find_feet();
    std::vector<double> distances;
    for (const PolylineFoot& foot : feet_)
      if (!beyond(foot)) distances.push_back(foot.distance);
    if (!distances.empty()) spread_ = std::max(quantile(std::move(distances), 0.5), 0.5 * noise_);
    std::vector<double> weights(points_.size(), 0);
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (!beyond(feet_[i])) weights[i] = tukey(feet_[i].distance / std::max(3 * spread_, 1e-12));
    survey(weights);
    NormalEquations equations(4 * tube_.axis.size());
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (weights[i] > 0) add_pull(equations, points_[i], feet_[i], weights[i]);
    add_smoothness(equations);
    move(equations);
    tube_.radii.assign(tube_.axis.size(), spread_);
  }

  void step() {
    find_feet();
    const double scale = std::max({1.4826 * deviation_, 0.3 * noise_, 0.02 * spread_});
    std::vector<double> weights(points_.size(), 0);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (beyond(feet_[i])) continue;
      weights[i] = tukey((feet_[i].distance - value_at(tube_.radii, feet_[i])) / (kTukey * scale));
    }
    survey(weights);
    NormalEquations equations(4 * tube_.axis.size());
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (weights[i] == 0) continue;
      add_ring(equations, points_[i], feet_[i], weights[i]);
      const double pull =
          (1 - feet_[i].t) * stations_[feet_[i].segment].pull + feet_[i].t * stations_[feet_[i].segment + 1].pull;
      add_pull(equations, points_[i], feet_[i], pull * weights[i]);
    }
    add_smoothness(equations);
    move(equations);
  }

  void move_end() {
    const std::size_t m = tube_.axis.size();
    const Vec3 end = tube_.axis.back(), direction = unit(end - tube_.axis[m - 2]);
    std::vector<double> ahead;
    for (const Vec3& p : points_)
      if (const double s = dot(p - end, direction); norm(p - end) < 4 * spread_ + norm(end - tube_.axis[m - 2]))
        ahead.push_back(s);
    if (ahead.size() < kLeastPoints) return;
    const double shift = quantile(ahead, 0.97) - tube_.radii.back();
    const double segment = norm(end - tube_.axis[m - 2]);
    tube_.axis.back() = end + std::max(shift, -0.7 * segment) * direction;
  }

  Tube take() {
    tube_.deviation = 1.4826 * deviation_;
    return std::move(tube_);
  }

 private:
  static double tukey(double ratio) { return std::abs(ratio) < 1 ? (1 - ratio * ratio) * (1 - ratio * ratio) : 0; }

  bool beyond(const PolylineFoot& foot) const {
    return (foot.segment == 0 && foot.t == 0) || (foot.segment + 2 == tube_.axis.size() && foot.t == 1);
  }

  void find_feet() {
    const bool first = feet_.empty();
    feet_.resize(points_.size());
    std::vector<double> off;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const std::size_t k = feet_[i].segment;
      feet_[i] = first ? nearest_on_polyline(tube_.axis, points_[i])
                       : nearest_on_polyline(tube_.axis, points_[i], k > kStray ? k - kStray : 0, k + kStray);
      if (!beyond(feet_[i])) off.push_back(std::abs(feet_[i].distance - value_at(tube_.radii, feet_[i])));
    }
    deviation_ = quantile(std::move(off), 0.5);
  }

  // What the points around each station say.
  void survey(const std::vector<double>& weights) {
    struct Sums {
      double weight = 0, squares = 0, residuals = 0;
      Vec3 out;
    };
    const std::size_t m = tube_.axis.size();
    std::vector<Sums> sums(m);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (weights[i] == 0) continue;
      const PolylineFoot& foot = feet_[i];
      const double off = foot.distance - value_at(tube_.radii, foot);
      for (const std::size_t end : {0, 1}) {
        const double w = weights[i] * (end == 0 ? 1 - foot.t : foot.t);
        Sums& s = sums[foot.segment + end];
        s.weight += w;
        s.squares += w * foot.distance * foot.distance;
        s.residuals += w * off * off;
        s.out += w * (points_[i] - foot.point);
      }
    }
    for (std::size_t k = 0; k < m; ++k) {
      tube_.support[k] = sums[k].weight;
      Sums around;
      for (std::size_t j = k > 0 ? k - 1 : 0; j <= std::min(k + 1, m - 1); ++j) {
        const double share = j == k ? 1 : 0.5;
        around.weight += share * sums[j].weight;
        around.squares += share * sums[j].squares;
        around.residuals += share * sums[j].residuals;
        around.out += share * sums[j].out;
      }
      Station& station = stations_[k];
      if (!(around.weight > 0)) continue;
      const double spread = around.squares / around.weight - norm2((1 / around.weight) * around.out);
      const double blur = noise_ * noise_ / std::max(spread, 1e-18);
      station.pull = std::clamp(kCentring * blur * blur, kLeastCentring, kMostCentring);
      if (around.weight < kLeastPoints) continue;
      const double off = std::sqrt(around.residuals / around.weight / std::max(spread, 1e-18));
      const double ring = std::clamp((kCloud - off) / (kCloud - kRing), 0.0, 1.0);
      station.largest = (kLargestCloud + ring * (kLargestRing - kLargestCloud)) * std::sqrt(std::max(spread, 0.0));
    }
  }

  void add_ring(NormalEquations& equations, const Vec3& p, const PolylineFoot& foot, double weight) const {
    if (!(foot.distance > 1e-12)) return;
    const std::size_t a = 4 * foot.segment, b = a + 4;
    const double s = 1 - foot.t, t = foot.t;
    const Vec3 u = (1 / foot.distance) * (p - foot.point);
    equations.add<8>({a, a + 1, a + 2, a + 3, b, b + 1, b + 2, b + 3},
                     {s * u.x, s * u.y, s * u.z, s, t * u.x, t * u.y, t * u.z, t},
                     foot.distance - value_at(tube_.radii, foot), weight);
  }

  void add_pull(NormalEquations& equations, const Vec3& p, const PolylineFoot& foot, double weight) const {
    const std::size_t a = 4 * foot.segment, b = a + 4;
    const Vec3 out = p - foot.point;
    for (std::size_t k = 0; k < 3; ++k)
      equations.add<2>({a + k, b + k}, {1 - foot.t, foot.t}, out[static_cast<int>(k)], weight);
  }

  void move(const NormalEquations& equations) {
    Eigen::VectorXd x;
    if (!equations.solve(x)) return;
    for (std::size_t k = 0; k < tube_.axis.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(4 * k);
      Vec3 change{x[at], x[at + 1], x[at + 2]};
      const double length = norm(change), most = std::max(spread_, noise_);
      if (length > most) change *= most / length;
      tube_.axis[k] += change;
      tube_.radii[k] =
          std::clamp(tube_.radii[k] + x[at + 3], 0.2 * spread_, std::max(stations_[k].largest, 0.2 * spread_));
    }
  }

  void add_smoothness(NormalEquations& equations) const {
    const std::size_t m = tube_.axis.size();
    const auto points = [&](std::size_t k) { return std::max(tube_.support[k], kLeastSupport); };
    for (std::size_t k = 0; k + 2 < m; ++k) {
      const std::size_t a = 4 * k, b = a + 4, c = a + 8;
      const double weight = (points(k) + points(k + 1) + points(k + 2)) / 3;
      const Vec3 bend = tube_.axis[k] - 2 * tube_.axis[k + 1] + tube_.axis[k + 2];
      for (std::size_t i = 0; i < 3; ++i)
        equations.add<3>({a + i, b + i, c + i}, {1, -2, 1}, -bend[static_cast<int>(i)], kAxisStiffness * weight);
      const double kink = tube_.radii[k] - 2 * tube_.radii[k + 1] + tube_.radii[k + 2];
      equations.add<3>({a + 3, b + 3, c + 3}, {1, -2, 1}, -kink, kRadiusStiffness * weight);
    }
    for (std::size_t k = 0; k + 1 < m; ++k)
      equations.add<2>({4 * k + 3, 4 * k + 7}, {1, -1}, tube_.radii[k + 1] - tube_.radii[k], kRadiusSlope * points(k));
    // Points of the axis do not slide along it, and do not run away where nothing holds them.
    for (std::size_t k = 0; k < m; ++k) {
      const Vec3 along = unit(tube_.axis[std::min(k + 1, m - 1)] - tube_.axis[k > 0 ? k - 1 : 0]);
      const std::size_t a = 4 * k;
      equations.add<3>({a, a + 1, a + 2}, {along.x, along.y, along.z}, 0, points(k));
      for (std::size_t i = 0; i < 4; ++i) equations.add<1>({a + i}, {1}, 0, 1e-4 * points(k));
    }
  }

  struct Station {
    double pull = kLeastCentring;
    double largest = std::numeric_limits<double>::infinity();  // radius
  };

  const std::vector<Vec3>& points_;
  double noise_, spread_ = 0, deviation_ = 0;
  Tube tube_;
  std::vector<Station> stations_;
  std::vector<PolylineFoot> feet_;
};

}  // namespace

Tube fit_tube(const std::vector<Vec3>& points, const std::vector<Vec3>& line, double noise) {
  TubeFit fit(points, line, noise);
  if (points.size() >= kLeastPoints) {
    for (int i = 0; i < kCentringSteps; ++i) fit.centre();
    for (int i = 0; i < kSteps; ++i) {
      fit.step();
      if (i + 2 == kSteps) fit.move_end();
    }
  }
  return fit.take();
}

void remove_noise(double noise, std::vector<double>& radii) {
  for (double& r : radii) r = std::sqrt(std::max(r * r - noise * noise, kLeastRadius * kLeastRadius * r * r));
}

std::vector<double> non_increasing(const std::vector<double>& values, const std::vector<double>& weights) {
  struct Block {
    double mean, weight;
    std::size_t count;
  };
  std::vector<Block> blocks;
  for (std::size_t i = 0; i < values.size(); ++i) {
    blocks.push_back({values[i], weights[i], 1});
    while (blocks.size() > 1 && blocks[blocks.size() - 2].mean < blocks.back().mean) {
      const Block last = blocks.back();
      blocks.pop_back();
      Block& b = blocks.back();
      b.mean = (b.mean * b.weight + last.mean * last.weight) / (b.weight + last.weight);
      b.weight += last.weight;
      b.count += last.count;
    }
  }
  std::vector<double> out;
  for (const Block& b : blocks) out.insert(out.end(), b.count, b.mean);
  return out;
}

}  // namespace bisector
