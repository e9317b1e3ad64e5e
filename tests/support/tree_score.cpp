#include "support/tree_score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "mesh/sampling.h"
#include "spatial/kd_tree.h"
#include "tree/coverage.h"

namespace bisector::test {
namespace {

constexpr std::size_t kSamples = 50;     // along a branch's axis, to score it
constexpr double kSpacings = 3;          // length of the shortest branches of sparse scans that count
constexpr std::size_t kLeastPoints = 5;  // on them
constexpr double kBreastHeight = 1.3;    // m

struct AxisSample {
  Vec3 position;
  double radius;
};

// Evenly along a branch's axis, of what is outside its parent.
std::vector<AxisSample> free_axis(const std::vector<AxisBranch>& branches, std::size_t b) {
  const AxisBranch& branch = branches[b];
  const double length = axis_length(branch.axis);
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
      const NearOnAxis near = nearest_on_axis(parent, s.position);
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

// Of points off the surface.
double deviation_of(const TreeScan& scan) { return scan.noise + scan.beam; }

std::vector<Box> boxes_of(const std::vector<AxisBranch>& branches) {
  std::vector<Box> boxes;
  for (const AxisBranch& branch : branches) boxes.push_back(bounding_box(branch.axis));
  return boxes;
}

double from_box(const Box& box, const Vec3& p) {
  Vec3 off;
  for (int k = 0; k < 3; ++k) off[k] = std::max({box.lo[k] - p[k], p[k] - box.hi[k], 0.0});
  return norm(off);
}

bool has_loops(const std::vector<AxisBranch>& branches) {
  for (const AxisBranch& branch : branches) {
    std::size_t steps = 0;
    for (Index p = branch.parent; p != kNone; p = branches[p].parent)
      if (p >= branches.size() || ++steps > branches.size()) return true;
  }
  return false;
}

// How many samples of an axis are near another, and how near: of two that are near as many the nearer one counts.
struct Nearness {
  std::size_t samples = 0;
  double distance = 0;  // of all of them together

  void add(double d) { ++samples, distance += d; }
  bool operator<(const Nearness& other) const {
    return samples != other.samples ? samples < other.samples : distance > other.distance;
  }
};

// The true branch whose axis most of a found branch's free axis is near; kNone if less than half is near any.
std::vector<Index> followed(const std::vector<AxisBranch>& truth, const std::vector<AxisBranch>& found, double noise,
                            double reach, std::vector<double>& distances) {
  std::vector<Index> owner(found.size(), kNone);
  const std::vector<Box> boxes = boxes_of(truth);
  for (std::size_t f = 0; f < found.size(); ++f) {
    const std::vector<AxisSample> samples = free_axis(found, f);
    std::vector<Nearness> near(truth.size());
    std::size_t any = 0;
    for (const AxisSample& s : samples) {
      double least = std::numeric_limits<double>::infinity(), ratio = 0;
      bool is_near = false;
      for (std::size_t t = 0; t < truth.size(); ++t) {
        const double away = from_box(boxes[t], s.position);
        if (away > least && away > std::max(reach * truth[t].radii[0], noise)) continue;
        const NearOnAxis at = nearest_on_axis(truth[t], s.position);
        const bool near_this = at.distance <= std::max(reach * at.radius, noise);
        if (near_this) near[t].add(at.distance);
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

// What is to be found of a true branch.
struct Target {
  Index branch, parent;  // the parent, or the farthest ancestor that may stand for it
  std::vector<AxisSample> samples;
};

double distance_to_nearest(const KdTree& tree, const Vec3& p, std::size_t rank) {
  std::vector<Index> at(rank + 1);
  std::vector<double> squared(rank + 1);
  const double place[]{p.x, p.y, p.z};
  const std::size_t count = tree.knnSearch(place, rank + 1, at.data(), squared.data());
  return count > rank ? std::sqrt(squared[rank]) : std::numeric_limits<double>::infinity();
}

// Branches that a scan shows: what of their free axes has points near.
std::vector<Target> seen_targets(const TreeScan& scan) {
  std::vector<std::vector<Vec3>> points(scan.branches.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i)
    if (scan.point_branches[i] != kNone) points[scan.point_branches[i]].push_back(scan.points[i]);
  const PointSet all{scan.points};
  KdTree tree(3, all);
  tree.buildIndex();
  std::vector<Target> targets;
  std::vector<char> counts(scan.branches.size());
  for (std::size_t t = 0; t < scan.branches.size(); ++t) {
    if (points[t].size() < kLeastPoints) continue;
    std::vector<double> gaps;
    for (const Vec3& p : points[t]) gaps.push_back(distance_to_nearest(tree, p, 1));
    const double spacing = median(gaps);
    std::vector<AxisSample> samples = free_axis(scan.branches, t);
    if (!(axis_length(scan.branches[t].axis) * static_cast<double>(samples.size()) / kSamples > kSpacings * spacing))
      continue;
    const PointSet own_points{points[t]};
    KdTree own(3, own_points);
    own.buildIndex();
    std::erase_if(samples, [&](const AxisSample& s) {
      return distance_to_nearest(own, s.position, 0) > s.radius + kSpacings * std::max(spacing, deviation_of(scan));
    });
    if (samples.empty()) continue;
    counts[t] = 1;
    Index parent = scan.branches[t].parent;
    while (parent != kNone && !counts[parent]) parent = scan.branches[parent].parent;
    targets.push_back({static_cast<Index>(t), parent, std::move(samples)});
  }
  return targets;
}

TreeScore score_targets(const std::vector<Target>& targets, const std::vector<AxisBranch>& truth,
                        const std::vector<AxisBranch>& found, double noise, double reach,
                        std::vector<double>& thick_errors) {
  TreeScore score;
  score.loops = has_loops(found);
  for (const AxisBranch& branch : found) score.roots += branch.parent == kNone;
  std::vector<double> distances, errors;
  const std::vector<Index> owner = followed(truth, found, noise, reach, distances);
  score.spurious = static_cast<std::size_t>(std::count(owner.begin(), owner.end(), kNone));
  score.axis_median = median(distances);
  score.axis_mean = std::accumulate(distances.begin(), distances.end(), 0.0) / static_cast<double>(distances.size());

  const std::vector<Box> boxes = boxes_of(found);
  std::size_t total = 0, covered = 0;
  for (const Target& target : targets) {
    const std::vector<AxisSample>& samples = target.samples;
    ++score.branches;
    std::vector<char> seen(samples.size());
    std::size_t best = found.size();
    Nearness most;
    std::vector<std::pair<double, double>> best_errors;  // true radius and relative error
    for (std::size_t f = 0; f < found.size(); ++f) {
      std::vector<std::pair<double, double>> relative;
      Nearness nearness;
      for (std::size_t s = 0; s < samples.size(); ++s) {
        const double near = std::max(reach * samples[s].radius, noise);
        if (from_box(boxes[f], samples[s].position) > near) continue;
        const NearOnAxis at = nearest_on_axis(found[f], samples[s].position);
        if (!(at.distance <= near)) continue;
        seen[s] = 1;
        nearness.add(at.distance);
        relative.push_back({samples[s].radius, std::abs(at.radius - samples[s].radius) / samples[s].radius});
      }
      if (most < nearness) {
        most = nearness;
        best = f;
        best_errors = relative;
      }
    }
    total += samples.size();
    covered += static_cast<std::size_t>(std::count(seen.begin(), seen.end(), 1));
    if (static_cast<double>(most.samples) < 0.7 * static_cast<double>(samples.size())) continue;
    ++score.found;
    for (const auto& [radius, error] : best_errors) {
      errors.push_back(error);
      if (radius > noise) thick_errors.push_back(error);
    }
    const Index parent = found[best].parent;
    bool right = false;
    for (Index p = truth[target.branch].parent;; p = truth[p].parent) {
      right = right || (p == kNone ? parent == kNone : parent < found.size() && owner[parent] == p);
      if (p == target.parent) break;
    }
    score.right_parent += right;
  }
  score.covered = total ? static_cast<double>(covered) / static_cast<double>(total) : 0;
  score.radius_error = median(errors);
  return score;
}

}  // namespace

TreeScore score_tree(const std::vector<AxisBranch>& truth, const std::vector<AxisBranch>& found, double noise,
                     double reach) {
  std::vector<Target> targets;
  for (std::size_t t = 0; t < truth.size(); ++t) {
    std::vector<AxisSample> samples = free_axis(truth, t);
    const double length = axis_length(truth[t].axis) * static_cast<double>(samples.size()) / kSamples;
    if (!samples.empty() && length > 3 * samples.front().radius)
      targets.push_back({static_cast<Index>(t), truth[t].parent, std::move(samples)});
  }
  std::vector<double> thick_errors;
  return score_targets(targets, truth, found, noise, reach, thick_errors);
}

ScanScore score_scan(const TreeScan& scan, const std::vector<AxisBranch>& found) {
  std::vector<double> thick_errors;
  ScanScore score;
  static_cast<TreeScore&>(score) =
      score_targets(seen_targets(scan), scan.branches, found, 2 * deviation_of(scan), 1, thick_errors);
  score.thick_radius_error = median(thick_errors);
  score.volume_error = wood_volume(found) / wood_volume(scan.branches) - 1;
  return score;
}

LeafScore score_leaves(const TreeScan& scan, const std::vector<char>& is_leaf) {
  std::size_t both = 0, said = 0, truly = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const bool leaf = scan.kinds[i] == PointKind::leaf;
    both += leaf && is_leaf[i];
    said += is_leaf[i] != 0;
    truly += leaf;
  }
  const auto share = [](std::size_t part, std::size_t all) {
    return all ? static_cast<double>(part) / static_cast<double>(all) : 1.0;
  };
  return {share(both, said), share(both, truly)};
}

std::vector<AxisBranch> axes_of(const TreeResult& tree) {
  std::vector<AxisBranch> branches;
  for (const TreeBranch& b : tree.branches) {
    AxisBranch axis;
    axis.parent = b.parent;
    for (const Index n : b.nodes) {
      axis.axis.push_back(tree.skeleton[n].position);
      axis.radii.push_back(tree.skeleton[n].radius);
    }
    branches.push_back(std::move(axis));
  }
  return branches;
}

double wood_volume(const std::vector<AxisBranch>& branches) {
  double volume = 0;
  for (std::size_t b = 0; b < branches.size(); ++b) {
    const std::vector<AxisSample> samples = free_axis(branches, b);
    const double step = axis_length(branches[b].axis) / kSamples;
    for (const AxisSample& s : samples) volume += std::numbers::pi * s.radius * s.radius * step;
  }
  return volume;
}

SurfaceScore score_surfaces(const std::vector<Vec3>& points, const TreeResult& tree, double metre) {
  SurfaceScore score;
  const Box box = bounding_box(points);
  const double height = box.hi.z - box.lo.z;
  const TriangleMesh mesh = tree_mesh(tree);
  std::vector<BranchSurface> surfaces;
  for (const TreeBranch& branch : tree.branches) surfaces.push_back(branch.surface);
  score.near_points = share_within(cover_points(points, surfaces, mesh), 0.01 * height);

  score.bare_area = bare_area(mesh, points, 0.02 * height);

  const std::vector<AxisBranch> branches = axes_of(tree);
  double breast = 0, volume = 0;
  for (std::size_t b = 0; b < branches.size(); ++b) {
    volume += tree.branches[b].volume;
    const Index parent = branches[b].parent;
    if (parent != kNone) {
      score.thicker += tree.branches[b].base_radius > nearest_on_axis(branches[parent], branches[b].axis[0]).radius;
      continue;
    }
    for (std::size_t i = 1; i < branches[b].axis.size(); ++i)
      if (branches[b].axis[i].z > box.lo.z + kBreastHeight * metre) {
        breast = std::max(breast, branches[b].radii[i]);
        break;
      }
  }
  score.allometric = volume / (0.5 * std::numbers::pi * breast * breast * height);
  return score;
}

}  // namespace bisector::test
