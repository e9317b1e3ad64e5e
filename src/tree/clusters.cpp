#include "tree/clusters.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <tuple>

#include "core/parallel.h"

namespace bisector {
namespace {

constexpr std::size_t kLeastPoints = 12;  // in each half of a cluster that is split, about
constexpr double kOutOfRound = 0.15;  // rms of a tight cluster in radii, where that is more than ClusterOptions::delta
constexpr double kDamping = 0.1;      // of the regression that gives an axis, in the sum of the points' variances
constexpr double kConverged = 1e-3;   // relative change of the energy that ends Lloyd's iteration
constexpr int kRounds = 12;           // of splitting, at most

double energy(const Vec3& p, const BranchCylinder& c) {
  const Vec3 d = p - c.centre;
  const double along = dot(d, c.axis);
  const double off = norm(d - along * c.axis) - c.radius;
  return along * along + off * off;
}

class Clustering {
 public:
  Clustering(const std::vector<Vec3>& points, const Csr<Index>& neighbours, const std::vector<Index>& start,
             const std::vector<double>& distance, const ClusterOptions& options)
      : points_(points), neighbours_(neighbours), distance_(distance), options_(options) {
    result_.label = start;
    std::size_t count = 0;
    for (const Index c : start)
      if (c != kNone) count = std::max<std::size_t>(count, c + 1);
    result_.cylinders.resize(count);
    result_.fixed.assign(count, 0);
    seed_.assign(count, kNone);
  }

  // Lloyd's iteration over clusters that are not fixed.
  void iterate(const Context& context) {
    double before = std::numeric_limits<double>::infinity();
    for (int i = 0; i < options_.iterations; ++i) {
      context.check();
      flood();
      const double now = fit();
      if (!(std::abs(before - now) > kConverged * now)) break;
      before = now;
    }
  }

  // Moves each cluster's circle and seed to its points; the energy.
  double fit() {
    members_.assign(result_.cylinders.size(), {});
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (const Index c = result_.label[i]; c != kNone && !result_.fixed[c])
        members_[c].push_back(static_cast<Index>(i));
    std::vector<double> energies(members_.size(), 0);
    parallel_each(
        members_.size(),
        [&](std::size_t c) {
          if (result_.fixed[c] || members_[c].empty()) return;
          fit(c);
          for (const Index i : members_[c]) energies[c] += energy(points_[i], result_.cylinders[c]);
        },
        4);
    double sum = 0;
    for (const double e : energies) sum += e;
    return sum;
  }

  void fix_tight() {
    for (std::size_t c = 0; c < members_.size(); ++c) {
      const BranchCylinder& cylinder = result_.cylinders[c];
      if (result_.fixed[c] || members_[c].empty()) continue;
      const bool large = options_.max_points > 0 && members_[c].size() > options_.max_points;
      result_.fixed[c] = !large && cylinder.rms <= std::max(options_.delta, kOutOfRound * cylinder.radius);
    }
  }

  // Whether there was one to split.
  bool split() {
    const std::size_t before = members_.size();
    for (std::size_t c = 0; c < before; ++c) {
      if (result_.fixed[c] || members_[c].size() < 2 * kLeastPoints) continue;
      if (options_.most > 0 && result_.cylinders.size() >= options_.most) break;
      const Vec3 seed = points_[seed_[c]];
      const Index farthest = *std::max_element(members_[c].begin(), members_[c].end(), [&](Index a, Index b) {
        return norm2(points_[a] - seed) < norm2(points_[b] - seed);
      });
      result_.cylinders[c] = {seed, {0, 0, 1}, 0, 0, 0, 0};
      result_.cylinders.push_back({points_[farthest], {0, 0, 1}, 0, 0, 0, 0});
      result_.fixed.push_back(0);
      seed_.push_back(farthest);
    }
    return result_.cylinders.size() > before;
  }

  // Numbers without gaps: floods may leave a cluster without points.
  Clusters take() {
    std::vector<Index> number(result_.cylinders.size(), 0);
    for (const Index c : result_.label)
      if (c != kNone) number[c] = 1;
    Clusters out;
    for (std::size_t c = 0; c < number.size(); ++c) {
      if (!number[c]) continue;
      number[c] = static_cast<Index>(out.cylinders.size());
      out.cylinders.push_back(result_.cylinders[c]);
      out.fixed.push_back(result_.fixed[c]);
    }
    out.label = std::move(result_.label);
    for (Index& c : out.label)
      if (c != kNone) c = number[c];
    return out;
  }

 private:
  void fit(std::size_t c) {
    const std::vector<Index>& members = members_[c];
    std::vector<Vec3> own;
    own.reserve(members.size());
    Vec3 centre;
    double level = 0;
    for (const Index i : members) {
      own.push_back(points_[i]);
      centre += points_[i];
      level += distance_[i];
    }
    centre *= 1 / static_cast<double>(members.size());
    level /= static_cast<double>(members.size());
    result_.cylinders[c] = fit_cylinder(own, slope(members, centre, level));
    seed_[c] = *std::min_element(members.begin(), members.end(), [&](Index a, Index b) {
      return energy(points_[a], result_.cylinders[c]) < energy(points_[b], result_.cylinders[c]);
    });
  }

  // The direction in which the distance from the root rises, by linear regression; damped across thin clusters, where
  // there is nothing to tell it from.
  Vec3 slope(const std::vector<Index>& members, const Vec3& centre, double level) const {
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    Eigen::Vector3d rise = Eigen::Vector3d::Zero();
    for (const Index i : members) {
      const Vec3 p = points_[i] - centre;
      const Eigen::Vector3d d(p.x, p.y, p.z);
      spread += d * d.transpose();
      rise += (distance_[i] - level) * d;
    }
    spread.diagonal().array() += kDamping * spread.trace();
    const Eigen::Vector3d axis = spread.ldlt().solve(rise);
    return axis.allFinite() ? Vec3{axis.x(), axis.y(), axis.z()} : Vec3{};
  }

  void flood() {
    std::vector<char> open(points_.size(), 0);
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (const Index c = result_.label[i]; c != kNone && !result_.fixed[c]) open[i] = 1;
    using Entry = std::tuple<double, Index, Index>;  // energy, point, cluster
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    for (std::size_t c = 0; c < seed_.size(); ++c)
      if (!result_.fixed[c] && seed_[c] != kNone) queue.emplace(0.0, seed_[c], static_cast<Index>(c));
    const auto run = [&] {
      while (!queue.empty()) {
        const auto [cost, i, c] = queue.top();
        queue.pop();
        if (!open[i]) continue;
        open[i] = 0;
        result_.label[i] = c;
        for (const Index* j = neighbours_.begin(i); j != neighbours_.end(i); ++j)
          if (open[*j]) queue.emplace(energy(points_[*j], result_.cylinders[c]), *j, c);
      }
    };
    run();
    // What fixed clusters cut off from all seeds goes to them.
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (!open[i]) continue;
      for (const Index* j = neighbours_.begin(i); j != neighbours_.end(i); ++j)
        if (const Index c = result_.label[*j]; !open[*j] && c != kNone)
          queue.emplace(energy(points_[i], result_.cylinders[c]), static_cast<Index>(i), c);
    }
    run();
  }

  const std::vector<Vec3>& points_;
  const Csr<Index>& neighbours_;
  const std::vector<double>& distance_;
  const ClusterOptions& options_;
  Clusters result_;
  std::vector<Index> seed_;
  std::vector<std::vector<Index>> members_;
};

}  // namespace

Clusters cluster_points(const std::vector<Vec3>& points, const Csr<Index>& neighbours, const std::vector<Index>& start,
                        const std::vector<double>& distance, const ClusterOptions& options, const Context& context) {
  Clustering clustering(points, neighbours, start, distance, options);
  clustering.fit();
  for (int round = 0; round < kRounds; ++round) {
    clustering.iterate(context);
    clustering.fix_tight();
    if (round + 1 == kRounds || !clustering.split()) break;
  }
  return clustering.take();
}

}  // namespace bisector
