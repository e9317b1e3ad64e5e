#include "support/tree_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace bisector::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kHeight = 10;  // of the trunk's axis, roughly
constexpr double kStep = 0.03;  // along axes, of the growth

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
      const NearOnAxis near = nearest_on_axis(branches_[b], s.position);
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

}  // namespace

TreeModel make_tree(const TreeModelOptions& options) {
  SplitMix64 random(options.random_seed);
  TreeModel model;
  model.branches = grow_tree({.height = kHeight, .boughs = options.boughs, .twigs = options.twigs}, random);
  model.height = tree_height(model.branches);
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

}  // namespace bisector::test
