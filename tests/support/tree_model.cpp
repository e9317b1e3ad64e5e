#include "support/tree_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "support/models.h"

namespace bisector::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kHeight = 10;                                 // of the trunk's axis, roughly
constexpr double kStep = 0.03;                                 // along axes
constexpr double kPipe = 2.3;                                  // exponent of the pipe model
constexpr double kTrunkRadius = 0.25;                          // at the base
constexpr std::array<double, 3> kThickness{0.25, 0.11, 0.05};  // of each order, at most, to keep distances by
constexpr double kGap = 0.1;  // between surfaces of branches that are not each other's parent
constexpr int kTries = 60;    // to place a branch
constexpr double kGoldenAngle = 2.399963229728653;
constexpr std::size_t kSamples = 50;  // along a branch's axis, to score it

Vec3 any_perpendicular(const Vec3& a) {
  return unit(cross(a, std::abs(a.x) < 0.5 * norm(a) ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
}

// In the plane across `a`, at an angle from an arbitrary direction in it.
Vec3 across(const Vec3& a, double angle) {
  const Vec3 n = any_perpendicular(a), b = cross(unit(a), n);
  return std::cos(angle) * n + std::sin(angle) * b;
}

double gaussian(SplitMix64& random) {
  return std::sqrt(-2 * std::log(1 - random.unit())) * std::cos(2 * kPi * random.unit());
}

struct NearOnAxis {
  double distance = std::numeric_limits<double>::infinity();
  double place = 0;   // index of the point of the axis, with its share to the next
  double radius = 0;  // there
};

NearOnAxis nearest(const AxisBranch& branch, const Vec3& p) {
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

double length_of(const std::vector<Vec3>& axis) {
  double length = 0;
  for (std::size_t i = 1; i < axis.size(); ++i) length += norm(axis[i] - axis[i - 1]);
  return length;
}

// ---- growing

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

struct Growing {
  std::vector<AxisBranch> branches;
  std::vector<int> order;
  std::vector<std::size_t> fork;  // point of the parent's axis
};

// Whether an axis keeps its distance from all branches once it has parted from its parent.
bool has_room(const Growing& tree, const std::vector<Vec3>& axis, int order, std::size_t parent) {
  const auto thickness = [&](std::size_t b) { return kThickness[static_cast<std::size_t>(tree.order[b])]; };
  const double own = kThickness[static_cast<std::size_t>(order)];
  std::size_t parted = 0;
  while (parted < axis.size() && nearest(tree.branches[parent], axis[parted]).distance < own + thickness(parent))
    ++parted;
  if (2 * parted > axis.size()) return false;
  for (std::size_t b = 0; b < tree.branches.size(); ++b) {
    const double clear = own + thickness(b) + (b == parent ? 0 : kGap);
    const Box box = bounding_box(tree.branches[b].axis);
    for (std::size_t i = parted; i < axis.size(); ++i) {
      bool outside = false;
      for (int k = 0; k < 3; ++k) outside = outside || axis[i][k] < box.lo[k] - clear || axis[i][k] > box.hi[k] + clear;
      if (!outside && nearest(tree.branches[b], axis[i]).distance < clear) return false;
    }
  }
  return true;
}

// A child at a share of its parent's length; left out if there is no room.
void add_child(Growing& tree, SplitMix64& random, std::size_t parent, double share, double azimuth, double inclination,
               double length) {
  const std::vector<Vec3> on = tree.branches[parent].axis;
  const auto fork = static_cast<std::size_t>(share * static_cast<double>(on.size() - 2));
  const Vec3 along = unit(on[fork + 1] - on[fork]);
  const int order = tree.order[parent] + 1;
  for (int k = 0; k < kTries; ++k) {
    const double angle = inclination * random.range(0.85, 1.15);
    const Vec3 heading = std::cos(angle) * along + std::sin(angle) * across(along, azimuth);
    const std::vector<Vec3> axis = grow_axis(random, on[fork], heading, length, order == 1 ? 0.25 : 0.15, 0.5);
    if (has_room(tree, axis, order, parent) && axis.back().z > 0.05 * kHeight) {
      tree.branches.push_back({axis, std::vector<double>(axis.size()), static_cast<Index>(parent)});
      tree.order.push_back(order);
      tree.fork.push_back(fork);
      return;
    }
    azimuth += kGoldenAngle;
    length *= 0.98;
  }
}

Growing grow(const TreeModelOptions& options, SplitMix64& random) {
  Growing tree;
  const std::vector<Vec3> trunk = grow_axis(random, {12, -7, 3}, {0, 0, 1}, kHeight, 0.2, 0.15);
  tree.branches.push_back({trunk, std::vector<double>(trunk.size()), kNone});
  tree.order.push_back(0);
  tree.fork.push_back(0);
  double azimuth = random.range(0, 2 * kPi);
  for (std::size_t i = 0; i < options.boughs; ++i, azimuth += kGoldenAngle) {
    const double share =
        0.2 + 0.7 * (static_cast<double>(i) + random.range(0.2, 0.8)) / static_cast<double>(options.boughs);
    const double rest = (1 - share) * kHeight;
    const double crown = 0.42 * kHeight * std::sqrt(std::sin(kPi * std::min(1.0, share + 0.1)));
    add_child(tree, random, 0, share, azimuth, (75 - 30 * share) * kPi / 180,
              std::min(0.8 * rest, crown * random.range(0.75, 1.1)));
  }
  const std::size_t boughs = tree.branches.size();
  for (std::size_t b = 1; b < boughs; ++b) {
    const double length = length_of(tree.branches[b].axis);
    azimuth = random.range(0, 2 * kPi);
    for (std::size_t i = 0; i < options.twigs; ++i, azimuth += kGoldenAngle) {
      const double share =
          0.25 + 0.6 * (static_cast<double>(i) + random.range(0.2, 0.8)) / static_cast<double>(options.twigs);
      const double wanted = std::min(0.8 * (1 - share) * length, 0.14 * kHeight) * random.range(0.7, 1);
      if (wanted > 0.03 * kHeight) add_child(tree, random, b, share, azimuth, 50 * kPi / 180, wanted);
    }
  }
  return tree;
}

// r^kPipe at each point, in tips: one, growing with the length beyond, and the children's; a fork's step is spread over
// what the child is thick.
void assign_radii(Growing& tree) {
  std::vector<std::vector<double>> flow(tree.branches.size());
  for (std::size_t b = tree.branches.size(); b-- > 0;) {
    const std::size_t n = tree.branches[b].axis.size();
    flow[b].resize(n);
    for (std::size_t i = 0; i < n; ++i)
      flow[b][i] = 1 + 1.5 * static_cast<double>(n - 1 - i) / static_cast<double>(n - 1);
    for (std::size_t c = b + 1; c < tree.branches.size(); ++c) {
      if (tree.branches[c].parent != b) continue;
      const double spread = 5;  // points of the axis
      for (std::size_t i = 0; i < n; ++i) {
        const double beyond = (static_cast<double>(i) - static_cast<double>(tree.fork[c])) / spread;
        flow[b][i] += flow[c][0] * std::clamp(1 - beyond, 0.0, 1.0);
      }
    }
  }
  const double scale = kTrunkRadius / std::pow(flow[0][0], 1 / kPipe);
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
    for (std::size_t i = 0; i < flow[b].size(); ++i)
      tree.branches[b].radii[i] = scale * std::pow(flow[b][i], 1 / kPipe);
}

// ---- scanning

struct Sample {
  Vec3 position, normal;
  std::size_t branch;
  double place;  // on its axis
};

// Points on the surfaces by area.
class Surfaces {
 public:
  explicit Surfaces(const std::vector<AxisBranch>& branches) : branches_(branches) {
    for (std::size_t b = 0; b < branches.size(); ++b) {
      Box box = bounding_box(branches[b].axis);
      const double thick = *std::max_element(branches[b].radii.begin(), branches[b].radii.end());
      for (int k = 0; k < 3; ++k) box.lo[k] -= thick, box.hi[k] += thick;
      boxes_.push_back(box);
      for (std::size_t i = 0; i + 1 < branches[b].axis.size(); ++i) {
        area_.push_back((area_.empty() ? 0 : area_.back()) + norm(branches[b].axis[i + 1] - branches[b].axis[i]) *
                                                                 (branches[b].radii[i] + branches[b].radii[i + 1]));
        segment_.push_back({b, i});
      }
    }
  }

  Sample draw(SplitMix64& random) const {
    const auto at = std::upper_bound(area_.begin(), area_.end(), random.unit() * area_.back());
    const auto [b, i] = segment_[std::min(static_cast<std::size_t>(at - area_.begin()), segment_.size() - 1)];
    const AxisBranch& branch = branches_[b];
    const double t = random.unit();
    const Vec3 along = branch.axis[i + 1] - branch.axis[i], normal = across(along, random.range(0, 2 * kPi));
    const double radius = (1 - t) * branch.radii[i] + t * branch.radii[i + 1];
    return {branch.axis[i] + t * along + radius * normal, normal, b, static_cast<double>(i) + t};
  }

  bool inside_another(const Sample& s) const {
    for (std::size_t b = 0; b < branches_.size(); ++b) {
      bool outside = b == s.branch;
      for (int k = 0; k < 3; ++k)
        outside = outside || s.position[k] < boxes_[b].lo[k] || s.position[k] > boxes_[b].hi[k];
      if (outside) continue;
      const NearOnAxis near = nearest(branches_[b], s.position);
      if (near.distance < near.radius) return true;
    }
    return false;
  }

 private:
  const std::vector<AxisBranch>& branches_;
  std::vector<Box> boxes_;
  std::vector<double> area_;  // up to each segment
  std::vector<std::array<std::size_t, 2>> segment_;
};

std::vector<Sample> scan(const std::vector<AxisBranch>& branches, std::size_t count, SplitMix64& random) {
  const Surfaces surfaces(branches);
  std::array<Vec3, 3> scanners;
  const double first = random.range(0, 2 * kPi);
  for (std::size_t k = 0; k < 3; ++k) {
    const double angle = first + 2 * kPi * static_cast<double>(k) / 3;
    scanners[k] = branches[0].axis[0] + kHeight * Vec3{std::cos(angle), std::sin(angle), 0.15};
  }
  std::vector<Sample> samples;
  while (samples.size() < count) {
    const Sample s = surfaces.draw(random);
    double density = 0;
    for (const Vec3& scanner : scanners) {
      const Vec3 to = scanner - s.position;
      density += std::max(0.0, dot(to, s.normal)) * kHeight * kHeight / std::pow(norm(to), 3);
    }
    if (random.unit() * 1.5 < density && !surfaces.inside_another(s)) samples.push_back(s);
  }
  return samples;
}

// Takes the share `occlusion` of the samples away: half in balls, half on sides.
std::vector<Sample> occlude(const std::vector<Sample>& samples, const std::vector<AxisBranch>& branches,
                            double occlusion, SplitMix64& random) {
  std::vector<char> missing(samples.size());
  std::size_t count = 0;
  const auto take = [&](std::size_t i, bool away) {
    if (away && !missing[i]) missing[i] = 1, ++count;
  };
  const double total = static_cast<double>(samples.size());
  while (static_cast<double>(count) < 0.5 * occlusion * total) {
    const Vec3 centre = samples[random.below(samples.size())].position;
    const double radius = kHeight * random.range(0.005, 0.015);
    for (std::size_t i = 0; i < samples.size(); ++i) take(i, norm2(samples[i].position - centre) < radius * radius);
  }
  while (static_cast<double>(count) < occlusion * total) {
    const Sample& from = samples[random.below(samples.size())];
    const double half = 0.5 * kHeight * random.range(0.03, 0.12) / kStep;
    const auto i0 = std::min(static_cast<std::size_t>(from.place), branches[from.branch].axis.size() - 2);
    const Vec3 side =
        across(branches[from.branch].axis[i0 + 1] - branches[from.branch].axis[i0], random.range(0, 2 * kPi));
    for (std::size_t i = 0; i < samples.size(); ++i)
      take(i, samples[i].branch == from.branch && std::abs(samples[i].place - from.place) < half &&
                  dot(samples[i].normal, side) > std::cos(70 * kPi / 180));
  }
  std::vector<Sample> left;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (!missing[i]) left.push_back(samples[i]);
  return left;
}

// ---- scoring

struct AxisSample {
  Vec3 position;
  double radius;
};

// Evenly along a branch's axis, of what is outside its parent.
std::vector<AxisSample> free_axis(const std::vector<AxisBranch>& branches, std::size_t b) {
  const AxisBranch& branch = branches[b];
  const double length = length_of(branch.axis);
  std::vector<AxisSample> samples;
  double walked = 0;
  std::size_t next = 0;
  for (std::size_t i = 1; i < branch.axis.size(); ++i) {
    const double step = norm(branch.axis[i] - branch.axis[i - 1]);
    for (; next < kSamples; ++next) {
      const double at = length * (static_cast<double>(next) + 0.5) / kSamples;
      if (!(step > 0) || at > walked + step) break;
      const double t = (at - walked) / step;
      samples.push_back(
          {(1 - t) * branch.axis[i - 1] + t * branch.axis[i], (1 - t) * branch.radii[i - 1] + t * branch.radii[i]});
    }
    walked += step;
  }
  if (branch.parent < branches.size() && branch.parent != b) {
    const AxisBranch& parent = branches[branch.parent];
    std::erase_if(samples, [&](const AxisSample& s) {
      const NearOnAxis near = nearest(parent, s.position);
      return near.distance <= near.radius;
    });
  }
  return samples;
}

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::infinity();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool has_loops(const std::vector<AxisBranch>& branches) {
  for (const AxisBranch& branch : branches) {
    std::size_t steps = 0;
    for (Index p = branch.parent; p != kNone; p = branches[p].parent)
      if (p >= branches.size() || ++steps > branches.size()) return true;
  }
  return false;
}

// The true branch whose axis most of a found branch's free axis is near; kNone if less than half is near any.
std::vector<Index> followed(const std::vector<AxisBranch>& truth, const std::vector<AxisBranch>& found, double noise,
                            double reach, std::vector<double>& distances) {
  std::vector<Index> owner(found.size(), kNone);
  for (std::size_t f = 0; f < found.size(); ++f) {
    const std::vector<AxisSample> samples = free_axis(found, f);
    std::vector<std::size_t> near(truth.size());
    std::size_t any = 0;
    for (const AxisSample& s : samples) {
      double least = std::numeric_limits<double>::infinity(), ratio = 0;
      bool is_near = false;
      for (std::size_t t = 0; t < truth.size(); ++t) {
        const NearOnAxis at = nearest(truth[t], s.position);
        const bool near_this = at.distance <= std::max(reach * at.radius, noise);
        near[t] += near_this;
        is_near = is_near || near_this;
        if (at.distance < least) least = at.distance, ratio = at.distance / at.radius;
      }
      any += is_near;
      distances.push_back(ratio);
    }
    const auto best = std::max_element(near.begin(), near.end());
    if (2 * any >= samples.size() && !samples.empty()) owner[f] = static_cast<Index>(best - near.begin());
  }
  return owner;
}

}  // namespace

TreeModel make_tree(const TreeModelOptions& options) {
  SplitMix64 random(options.random_seed);
  Growing tree = grow(options, random);
  assign_radii(tree);
  TreeModel model;
  model.branches = std::move(tree.branches);
  double top = 0;
  for (const AxisBranch& branch : model.branches)
    for (const Vec3& p : branch.axis) top = std::max(top, p.z);
  model.height = top - model.branches[0].axis[0].z;
  model.noise = options.noise * model.height;

  const auto samples = static_cast<std::size_t>(static_cast<double>(options.points) / (1 - options.occlusion));
  const std::vector<Sample> seen =
      occlude(scan(model.branches, samples, random), model.branches, options.occlusion, random);
  for (const Sample& s : seen) {
    Vec3 p = s.position;
    for (int k = 0; k < 3; ++k) p[k] += model.noise * gaussian(random);
    model.points.push_back(p);
  }
  return model;
}

TreeScore score_tree(const std::vector<AxisBranch>& truth, const std::vector<AxisBranch>& found, double noise,
                     double reach) {
  TreeScore score;
  score.loops = has_loops(found);
  for (const AxisBranch& branch : found) score.roots += branch.parent == kNone;
  std::vector<double> distances, errors;
  const std::vector<Index> owner = followed(truth, found, noise, reach, distances);
  score.spurious = static_cast<std::size_t>(std::count(owner.begin(), owner.end(), kNone));
  score.axis_median = median(distances);
  score.axis_mean = std::accumulate(distances.begin(), distances.end(), 0.0) / static_cast<double>(distances.size());

  std::size_t total = 0, covered = 0;
  for (std::size_t t = 0; t < truth.size(); ++t) {
    const std::vector<AxisSample> samples = free_axis(truth, t);
    const double length = length_of(truth[t].axis) * static_cast<double>(samples.size()) / kSamples;
    if (samples.empty() || !(length > 3 * samples.front().radius)) continue;
    ++score.branches;
    std::vector<char> seen(samples.size());
    std::size_t best = found.size(), most = 0;
    std::vector<double> best_errors;
    for (std::size_t f = 0; f < found.size(); ++f) {
      std::vector<double> relative;
      for (std::size_t s = 0; s < samples.size(); ++s) {
        const NearOnAxis at = nearest(found[f], samples[s].position);
        if (!(at.distance <= std::max(reach * samples[s].radius, noise))) continue;
        seen[s] = 1;
        relative.push_back(std::abs(at.radius - samples[s].radius) / samples[s].radius);
      }
      if (relative.size() > most) {
        most = relative.size();
        best = f;
        best_errors = relative;
      }
    }
    total += samples.size();
    covered += static_cast<std::size_t>(std::count(seen.begin(), seen.end(), 1));
    if (static_cast<double>(most) < 0.7 * static_cast<double>(samples.size())) continue;
    ++score.found;
    errors.insert(errors.end(), best_errors.begin(), best_errors.end());
    const Index parent = found[best].parent;
    const bool right =
        truth[t].parent == kNone ? parent == kNone : parent < found.size() && owner[parent] == truth[t].parent;
    score.right_parent += right;
  }
  score.covered = total ? static_cast<double>(covered) / static_cast<double>(total) : 0;
  score.radius_error = median(errors);
  return score;
}

}  // namespace bisector::test
