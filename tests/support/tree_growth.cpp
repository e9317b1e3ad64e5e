#include "support/tree_growth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace bisector::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kStep = 0.03;  // along axes
// Radius of each level (stems, boughs, twigs, shoots), at most, of the trunk's, to keep distances by.
constexpr std::array<double, 4> kThickness{1, 0.44, 0.2, 0.1};
constexpr double kGap = 0.1;  // between surfaces of branches that are not each other's parent
constexpr int kTries = 60;    // to place a branch
constexpr double kGoldenAngle = 2.399963229728653;

Vec3 any_perpendicular(const Vec3& a) {
  return unit(cross(a, std::abs(a.x) < 0.5 * norm(a) ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
}

// From `start` along `heading`, turning at random and towards `up`.
std::vector<Vec3> grow_axis(SplitMix64& random, const Vec3& start, Vec3 heading, double length, double up,
                            double wander) {
  std::vector<Vec3> axis{start};
  Vec3 turn;
  const auto steps = static_cast<std::size_t>(std::ceil(length / kStep));
  for (std::size_t i = 0; i < steps; ++i) {
    for (int k = 0; k < 3; ++k) turn[k] = 0.95 * turn[k] + 0.3 * wander * gaussian(random);
    heading = unit(heading + kStep * (turn + Vec3{0, 0, up}));
    axis.push_back(axis.back() + (length / static_cast<double>(steps)) * heading);
  }
  return axis;
}

class Growing {
 public:
  Growing(const TreeGrowth& growth, SplitMix64& random) : growth_(growth), random_(random) {
    const Vec3 heading =
        std::cos(growth.lean) * Vec3{0, 0, 1} +
        (growth.lean > 0 ? std::sin(growth.lean) * across({0, 0, 1}, random.range(0, 2 * kPi)) : Vec3{});
    const std::vector<Vec3> trunk = grow_axis(random, growth.base, heading, growth.height, 0.2, 0.15);
    push({trunk, std::vector<double>(trunk.size()), kNone}, 0, 0);
    if (growth.fork > 0)
      add_child(0, 0, growth.fork, random.range(0, 2 * kPi), 30 * kRadiansPerDegree,
                0.85 * (1 - growth.fork) * growth.height);
    add_boughs();
    const std::size_t stems = std::count(level_.begin(), level_.end(), 0u), boughs = branches_.size();
    add_twigs(stems, boughs, growth.twigs, 0.14 * growth.height, 0.03 * growth.height);
    const std::size_t twigs = branches_.size();
    add_twigs(boughs, twigs, growth.shoots, 0.06 * growth.height, 0.015 * growth.height);
    assign_radii();
  }

  std::vector<AxisBranch> take() { return std::move(branches_); }

 private:
  void push(AxisBranch branch, std::size_t level, std::size_t fork) {
    boxes_.push_back(bounding_box(branch.axis));
    branches_.push_back(std::move(branch));
    level_.push_back(level);
    fork_.push_back(fork);
  }

  double thickness(std::size_t level) const { return growth_.trunk_radius * kThickness[level]; }

  // Whether an axis keeps its distance from all branches once it has parted from its parent.
  bool has_room(const std::vector<Vec3>& axis, std::size_t level, std::size_t parent) const {
    const double own = thickness(level), parting = own + thickness(level_[parent]);
    std::size_t parted = 0;
    while (parted < axis.size() && nearest_on_axis(branches_[parent], axis[parted]).distance < parting) ++parted;
    if (2 * parted > axis.size()) return false;
    for (std::size_t b = 0; b < branches_.size(); ++b) {
      const double clear = own + thickness(level_[b]) + (b == parent ? 0 : kGap);
      const Box& box = boxes_[b];
      for (std::size_t i = parted; i < axis.size(); ++i) {
        bool outside = false;
        for (int k = 0; k < 3; ++k)
          outside = outside || axis[i][k] < box.lo[k] - clear || axis[i][k] > box.hi[k] + clear;
        if (!outside && nearest_on_axis(branches_[b], axis[i]).distance < clear) return false;
      }
    }
    return true;
  }

  // A child at a share of its parent's length; left out if there is no room.
  void add_child(std::size_t parent, std::size_t level, double share, double azimuth, double inclination,
                 double length) {
    const std::vector<Vec3> on = branches_[parent].axis;
    const auto fork = static_cast<std::size_t>(share * static_cast<double>(on.size() - 2));
    const Vec3 along = unit(on[fork + 1] - on[fork]);
    for (int k = 0; k < kTries; ++k) {
      const double angle = inclination * random_.range(0.85, 1.15);
      const Vec3 heading = std::cos(angle) * along + std::sin(angle) * across(along, azimuth);
      const std::vector<Vec3> axis = grow_axis(random_, on[fork], heading, length, level < 2 ? 0.25 : 0.15, 0.5);
      if (axis.back().z > growth_.base.z + 0.05 * growth_.height && has_room(axis, level, parent)) {
        push({axis, std::vector<double>(axis.size()), static_cast<Index>(parent)}, level, fork);
        return;
      }
      azimuth += kGoldenAngle;
      length *= 0.98;
    }
  }

  // On both stems, if the trunk forks.
  void add_boughs() {
    const std::size_t stems = branches_.size();
    double azimuth = random_.range(0, 2 * kPi);
    for (std::size_t i = 0; i < growth_.boughs; ++i, azimuth += kGoldenAngle) {
      const double share = growth_.crown_base + (0.9 - growth_.crown_base) *
                                                    (static_cast<double>(i) + random_.range(0.2, 0.8)) /
                                                    static_cast<double>(growth_.boughs);
      const double rest = (1 - share) * growth_.height;
      const double round = std::sqrt(std::sin(kPi * std::min(1.0, share + 0.1)));
      const double crown =
          growth_.crown_radius * growth_.height * ((1 - growth_.conical) * round + growth_.conical * (1 - share));
      const double inclination = growth_.low_angle + share * (growth_.high_angle - growth_.low_angle);
      const double length = std::min(0.8 * rest, crown * random_.range(0.75, 1.1));
      const bool on_second = stems > 1 && share > growth_.fork + 0.1 && i % 2 == 1;
      if (on_second) add_child(1, 1, (share - growth_.fork) / (1 - growth_.fork), azimuth, inclination, 0.8 * length);
      else add_child(0, 1, share, azimuth, inclination, length);
    }
  }

  void add_twigs(std::size_t first, std::size_t last, std::size_t count, double longest, double shortest) {
    for (std::size_t b = first; b < last; ++b) {
      const double length = axis_length(branches_[b].axis);
      double azimuth = random_.range(0, 2 * kPi);
      for (std::size_t i = 0; i < count; ++i, azimuth += kGoldenAngle) {
        const double share =
            0.25 + 0.6 * (static_cast<double>(i) + random_.range(0.2, 0.8)) / static_cast<double>(count);
        const double wanted = std::min(0.8 * (1 - share) * length, longest) * random_.range(0.7, 1);
        if (wanted > shortest) add_child(b, level_[b] + 1, share, azimuth, 50 * kRadiansPerDegree, wanted);
      }
    }
  }

  // A fork's step is spread over what the child is thick.
  void assign_radii() {
    std::vector<std::vector<double>> flow(branches_.size());  // r^pipe
    for (std::size_t b = branches_.size(); b-- > 0;) {
      const std::size_t n = branches_[b].axis.size();
      flow[b].resize(n);
      const double added = growth_.along + growth_.along_metre * axis_length(branches_[b].axis);
      for (std::size_t i = 0; i < n; ++i)
        flow[b][i] = growth_.tip + added * static_cast<double>(n - 1 - i) / static_cast<double>(n - 1);
      for (std::size_t c = b + 1; c < branches_.size(); ++c) {
        if (branches_[c].parent != b) continue;
        const double spread = 5;  // points of the axis
        for (std::size_t i = 0; i < n; ++i) {
          const double beyond = (static_cast<double>(i) - static_cast<double>(fork_[c])) / spread;
          flow[b][i] += flow[c][0] * std::clamp(1 - beyond, 0.0, 1.0);
        }
      }
    }
    const double scale = growth_.trunk_radius / std::pow(flow[0][0], 1 / growth_.pipe);
    for (std::size_t b = 0; b < branches_.size(); ++b)
      for (std::size_t i = 0; i < flow[b].size(); ++i)
        branches_[b].radii[i] = scale * std::pow(flow[b][i], 1 / growth_.pipe);
  }

  const TreeGrowth& growth_;
  SplitMix64& random_;
  std::vector<AxisBranch> branches_;
  std::vector<Box> boxes_;          // of the axes
  std::vector<std::size_t> level_;  // 0: stem, 1: bough, 2: twig, 3: shoot
  std::vector<std::size_t> fork_;   // point of the parent's axis
};

}  // namespace

TreeGrowth varied_growth(std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  TreeGrowth growth;
  growth.base = {random.range(-20, 20), random.range(-20, 20), random.range(-2, 2)};
  growth.height = random.range(5, 15);
  growth.trunk_radius = std::clamp(growth.height * random.range(0.012, 0.02), 0.1, 0.25);
  growth.pipe = random.range(2, 3);
  growth.tip = 0.01;
  growth.along = 0;
  growth.along_metre = 1;
  growth.lean = random.range(0, 10) * kRadiansPerDegree;
  growth.fork = random.unit() < 0.4 ? random.range(0.2, 0.5) : 0;
  growth.crown_base = random.range(0.15, 0.4);
  growth.crown_radius = random.range(0.25, 0.45);
  growth.conical = random.unit();
  growth.low_angle = random.range(60, 85) * kRadiansPerDegree;
  growth.high_angle = random.range(30, 50) * kRadiansPerDegree;
  growth.boughs = 8 + random.below(13);
  growth.twigs = 3 + random.below(3);
  growth.shoots = 1 + random.below(3);
  return growth;
}

std::vector<AxisBranch> grow_tree(const TreeGrowth& growth, SplitMix64& random) {
  return Growing(growth, random).take();
}

double tree_height(const std::vector<AxisBranch>& branches) {
  double top = -std::numeric_limits<double>::infinity();
  for (const AxisBranch& branch : branches)
    for (const Vec3& p : branch.axis) top = std::max(top, p.z);
  return top - branches[0].axis[0].z;
}

NearOnAxis nearest_on_axis(const AxisBranch& branch, const Vec3& p) {
  NearOnAxis best;
  for (std::size_t i = 0; i < branch.axis.size(); ++i) {
    const bool last = i + 1 == branch.axis.size();
    if (last && i > 0) break;
    const Vec3 from = branch.axis[i], along = last ? Vec3{} : branch.axis[i + 1] - from;
    const double length = norm2(along);
    const double t = length > 0 ? std::clamp(dot(p - from, along) / length, 0.0, 1.0) : 0;
    const double distance = norm(from + t * along - p);
    if (distance < best.distance)
      best = {distance, static_cast<double>(i) + t, (1 - t) * branch.radii[i] + t * branch.radii[last ? i : i + 1]};
  }
  return best;
}

double axis_length(const std::vector<Vec3>& axis) {
  double length = 0;
  for (std::size_t i = 1; i < axis.size(); ++i) length += norm(axis[i] - axis[i - 1]);
  return length;
}

Vec3 across(const Vec3& a, double angle) {
  const Vec3 n = any_perpendicular(a), b = cross(unit(a), n);
  return std::cos(angle) * n + std::sin(angle) * b;
}

double gaussian(SplitMix64& random) {
  return std::sqrt(-2 * std::log(1 - random.unit())) * std::cos(2 * std::numbers::pi * random.unit());
}

}  // namespace bisector::test
