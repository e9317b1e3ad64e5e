#include "support/tree_scan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bisector/error.h"
#include "core/parallel.h"

namespace bisector::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kEyeHeight = 1.6;            // of a tripod, m
constexpr double kCarHeight = 2;              // m
constexpr double kProfileDistance = 3;        // of a car's profiles, in the distance of points on them
constexpr double kSwathDistance = 12;         // m
constexpr double kGroundRadius = 3;           // m
constexpr double kPulseLength = 0.4;          // surfaces so near behind each other, in m, give one return
constexpr double kLeafTwig = 0.1;             // radius of the thickest twigs that have leaves, of the trunk's
constexpr double kLeafReach = 0.43;           // of leaves from the twig's axis, m
constexpr double kNeighbour = 0.8;            // distance of the trunks, in the lengths of both trees' longest boughs
constexpr std::size_t kMostLeaves = 100'000;  // on a tree
constexpr std::size_t kPilotPulses = 40'000;
constexpr int kScans = 6;             // with other steps, at most, until the count is right
constexpr double kCountError = 0.05;  // that is right
constexpr std::size_t kGrain = 4096;  // pulses of a chunk

struct Pulse {
  Vec3 origin, direction;
};

// Rays at equal steps of two numbers. A tripod's are azimuth and elevation, those of a line are where on it the scanner
// is and the angle in the plane across it.
struct Sweep {
  Vec3 origin, ahead, side;  // up is z
  bool turns = false;        // a tripod
  double u_lo = 0, u_hi = 0, v_lo = 0, v_hi = 0;
  double u_step = 1, v_step = 1;  // for a density of 1

  double pulses() const { return (u_hi - u_lo) / u_step * (v_hi - v_lo) / v_step; }
  Pulse at(double u, double v) const {
    const Vec3 up{0, 0, 1};
    if (turns) return {origin, std::cos(v) * (std::cos(u) * side + std::sin(u) * ahead) + std::sin(v) * up};
    return {origin + u * ahead, std::cos(v) * side + std::sin(v) * up};
  }
};

// All that may be met, seen from the sweep's place.
void aim(Sweep& sweep, const Box& box) {
  const Vec3 centre = 0.5 * (box.lo + box.hi) - sweep.origin;
  const double radius = 0.5 * std::hypot(box.hi.x - box.lo.x, box.hi.y - box.lo.y);
  const double along = dot(centre, sweep.ahead), off = dot(centre, sweep.side);
  const double away = std::hypot(along, off);
  const double nearest = std::max((sweep.turns ? away : off) - radius, 0.2);
  const double farthest = (sweep.turns ? away : off) + radius;
  if (sweep.turns) {
    const double middle = std::atan2(along, off), half = radius < away ? std::asin(radius / away) : kPi;
    sweep.u_lo = middle - half;
    sweep.u_hi = middle + half;
  } else {
    sweep.u_lo = along - radius;
    sweep.u_hi = along + radius;
  }
  const double low = box.lo.z - sweep.origin.z, high = box.hi.z - sweep.origin.z;
  sweep.v_lo = std::min(std::atan2(low, nearest), std::atan2(low, farthest));
  sweep.v_hi = std::max(std::atan2(high, nearest), std::atan2(high, farthest));
}

// From straight above, whose profiles reach to both sides: the angle is that in the plane of `side` and down.
void aim_down(Sweep& sweep, const Box& box) {
  const Vec3 centre = 0.5 * (box.lo + box.hi) - sweep.origin;
  const double radius = 0.5 * std::hypot(box.hi.x - box.lo.x, box.hi.y - box.lo.y);
  const double along = dot(centre, sweep.ahead), off = dot(centre, sweep.side), near = box.hi.z - sweep.origin.z,
               far = box.lo.z - sweep.origin.z;
  sweep.u_lo = along - radius;
  sweep.u_hi = along + radius;
  sweep.v_lo = std::min(std::atan2(near, off - radius), std::atan2(far, off - radius));
  sweep.v_hi = std::max(std::atan2(near, off + radius), std::atan2(far, off + radius));
}

std::vector<Sweep> sweeps_of(ScanPath path, const std::vector<AxisBranch>& branches, const Box& box,
                             SplitMix64& random) {
  const Vec3 base = branches[0].axis[0];
  const double azimuth = random.range(0, 2 * kPi), height = tree_height(branches);
  const Vec3 side{std::cos(azimuth), std::sin(azimuth), 0}, ahead{-side.y, side.x, 0}, up{0, 0, 1};
  std::vector<Sweep> sweeps;
  if (path == ScanPath::one_side) {
    sweeps.push_back({.origin = base - random.range(0.8, 1.3) * height * side + kEyeHeight * up,
                      .ahead = ahead,
                      .side = side,
                      .turns = true});
  } else if (path == ScanPath::street) {
    const double distance = random.range(5, 8);
    sweeps.push_back({.origin = base - distance * side + kCarHeight * up,
                      .ahead = ahead,
                      .side = side,
                      .u_step = kProfileDistance * distance});
  } else {
    const double above = random.range(40, 50), first = random.range(-0.5, 0.5);
    for (int k = -1; k <= 1; ++k)
      sweeps.push_back({.origin = base + kSwathDistance * (first + k) * side + above * up,
                        .ahead = ahead,
                        .side = side,
                        .u_step = above});
  }
  for (Sweep& sweep : sweeps) path == ScanPath::airborne ? aim_down(sweep, box) : aim(sweep, box);
  return sweeps;
}

struct Return {
  Vec3 point, origin;
  PointKind kind = PointKind::wood;
  Index branch = kNone;
  bool of_tree = false;  // the first
  double beam = 0;
};

class Scanner {
 public:
  // `leaves` are those of the first tree and of its neighbour in turn, if it has one.
  Scanner(const TreeScanOptions& options, const std::vector<AxisBranch>& branches, std::size_t tree_branches,
          const std::vector<LeafDisc>& leaves, std::uint64_t random_seed)
      : options_(options), scene_(branches, leaves), base_(branches[0].axis[0]), tree_branches_(tree_branches),
        random_seed_(random_seed) {}

  // What is met, where nothing is random; `range` is that to the ground at most.
  SceneHit meet(const Pulse& pulse, bool& ground) const {
    SceneHit hit = scene_.first_hit(pulse.origin, pulse.direction);
    const double range = ground_range(pulse);
    ground = range < hit.range;
    return ground ? SceneHit{range} : hit;
  }

  const TreeScene& scene() const { return scene_; }

  // Of steps `scale` times those of the sweeps.
  std::vector<Return> scan(const std::vector<Sweep>& sweeps, double scale) const {
    std::vector<Return> returns;
    std::uint64_t first = 0;
    for (const Sweep& sweep : sweeps) {
      const Raster raster(sweep, scale);
      std::vector<std::vector<Return>> chunks((raster.size() + kGrain - 1) / kGrain);
      parallel_chunks(raster.size(), kGrain, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          SplitMix64 random(SplitMix64(random_seed_ ^ (first + i)).next());
          Return echo;
          if (answer(raster.pulse(i, random), random, echo)) chunks[chunk].push_back(echo);
        }
      });
      for (const std::vector<Return>& chunk : chunks) returns.insert(returns.end(), chunk.begin(), chunk.end());
      first += raster.size();
    }
    return returns;
  }

  class Raster {
   public:
    Raster(const Sweep& sweep, double scale)
        : sweep_(sweep),
          columns_(static_cast<std::size_t>(std::ceil((sweep.u_hi - sweep.u_lo) / (scale * sweep.u_step)))),
          rows_(static_cast<std::size_t>(std::ceil((sweep.v_hi - sweep.v_lo) / (scale * sweep.v_step)))) {}
    std::size_t size() const { return columns_ * rows_; }
    // Off its place by a quarter of a step, at most.
    Pulse pulse(std::size_t i, SplitMix64& random) const {
      const double u = (static_cast<double>(i / rows_) + random.range(0.25, 0.75)) / static_cast<double>(columns_),
                   v = (static_cast<double>(i % rows_) + random.range(0.25, 0.75)) / static_cast<double>(rows_);
      return sweep_.at(sweep_.u_lo + u * (sweep_.u_hi - sweep_.u_lo), sweep_.v_lo + v * (sweep_.v_hi - sweep_.v_lo));
    }

   private:
    const Sweep& sweep_;
    std::size_t columns_, rows_;
  };

 private:
  double ground_range(const Pulse& pulse) const {
    constexpr double kNothing = std::numeric_limits<double>::infinity();
    if (!options_.ground || !(pulse.direction.z < 0)) return kNothing;
    const double range = (base_.z - pulse.origin.z) / pulse.direction.z;
    const Vec3 off = pulse.origin + range * pulse.direction - base_;
    return range > 0 && norm(off) < kGroundRadius ? range : kNothing;
  }

  // A ray drawn within the beam.
  Pulse within_beam(const Pulse& pulse, SplitMix64& random) const {
    const Vec3 w = std::sqrt(random.unit()) * across(pulse.direction, random.range(0, 2 * kPi));
    return {pulse.origin + 0.5 * options_.beam * w, unit(pulse.direction + 0.5 * options_.divergence * w)};
  }

  bool answer(const Pulse& pulse, SplitMix64& random, Return& echo) const {
    bool ground = false, other_ground = false;
    const SceneHit hit = meet(within_beam(pulse, random), ground);
    if (!std::isfinite(hit.range)) return false;
    double range = hit.range;
    if (random.unit() < options_.mixed) {
      const SceneHit other = meet(within_beam(pulse, random), other_ground);
      if (std::abs(other.range - range) < kPulseLength) range += random.unit() * (other.range - range);
    }
    range += options_.noise * gaussian(random);
    echo.origin = pulse.origin;
    echo.point = pulse.origin + range * pulse.direction;
    echo.kind = ground ? PointKind::ground : hit.leaf != kNone ? PointKind::leaf : PointKind::wood;
    echo.branch = hit.branch;
    echo.of_tree =
        !ground && (hit.leaf != kNone ? !options_.neighbour || hit.leaf % 2 == 0 : hit.branch < tree_branches_);
    echo.beam = 0.5 * (options_.beam + options_.divergence * hit.range);
    return true;
  }

  const TreeScanOptions& options_;
  TreeScene scene_;
  Vec3 base_;
  std::size_t tree_branches_;
  std::uint64_t random_seed_;
};

std::vector<Pulse> pilot_pulses(const std::vector<Sweep>& sweeps, double scale, SplitMix64& random) {
  std::vector<Pulse> pulses;
  for (const Sweep& sweep : sweeps) {
    const Scanner::Raster raster(sweep, scale);
    for (std::size_t i = 0; i < raster.size(); ++i) pulses.push_back(raster.pulse(i, random));
  }
  return pulses;
}

// How many of the leaves make the wanted share of what pulses meet.
std::size_t count_leaves(const TreeScanOptions& options, const std::vector<AxisBranch>& branches,
                         const std::vector<LeafDisc>& leaves, const std::vector<Pulse>& pulses) {
  const Scanner bare(options, branches, branches.size(), {}, 0);
  const TreeScene leafy({}, leaves);
  std::vector<Index> first(pulses.size(), kNone);  // leaf before the wood
  std::vector<char> wood(pulses.size());
  parallel_each(pulses.size(), [&](std::size_t i) {
    bool ground = false;
    const SceneHit hit = bare.meet(pulses[i], ground);
    wood[i] = hit.branch != kNone;
    first[i] = leafy.first_leaf(pulses[i].origin, pulses[i].direction, hit.range);
  });
  const auto share = [&](std::size_t count) {
    std::size_t of_leaves = 0, all = 0;
    for (std::size_t i = 0; i < pulses.size(); ++i) {
      of_leaves += first[i] < count;
      all += first[i] < count || wood[i];
    }
    return all ? static_cast<double>(of_leaves) / static_cast<double>(all) : 0.0;
  };
  if (share(leaves.size()) < options.leaves) throw Error("the tree has not room for so many leaves; ask for fewer");
  std::size_t few = 0, enough = leaves.size();
  while (few + 1 < enough) {
    const std::size_t middle = (few + enough) / 2;
    (share(middle) < options.leaves ? few : enough) = middle;
  }
  return enough;
}

std::vector<AxisBranch> grow_neighbour(const TreeGrowth& tree, std::uint64_t random_seed, SplitMix64& random) {
  TreeGrowth growth = varied_growth(~random_seed);
  const double distance = kNeighbour * (tree.crown_radius * tree.height + growth.crown_radius * growth.height);
  growth.base = tree.base + distance * across({0, 0, 1}, random.range(0, 2 * kPi));
  return grow_tree(growth, random);
}

}  // namespace

std::vector<LeafDisc> grow_leaves(const std::vector<AxisBranch>& branches, std::size_t count, SplitMix64& random) {
  std::vector<double> length;  // up to each piece
  std::vector<std::pair<std::size_t, std::size_t>> pieces;
  for (std::size_t b = 0; b < branches.size(); ++b)
    for (std::size_t i = 0; i + 1 < branches[b].axis.size(); ++i)
      if (branches[b].radii[i] < kLeafTwig * branches[0].radii[0]) {
        length.push_back((length.empty() ? 0 : length.back()) + norm(branches[b].axis[i + 1] - branches[b].axis[i]));
        pieces.push_back({b, i});
      }
  if (pieces.empty()) return {};
  std::vector<LeafDisc> leaves(count);
  for (LeafDisc& leaf : leaves) {
    const auto at = std::upper_bound(length.begin(), length.end(), random.unit() * length.back());
    const auto [b, i] = pieces[std::min(static_cast<std::size_t>(at - length.begin()), pieces.size() - 1)];
    const Vec3 from = branches[b].axis[i], along = branches[b].axis[i + 1] - from;
    leaf.radius = random.range(0.02, 0.05);
    const double stalk = branches[b].radii[i] + leaf.radius + random.range(0, 0.3);
    leaf.centre = from + random.unit() * along + stalk * across(along, random.range(0, 2 * kPi));
    const double z = random.range(-1, 1), azimuth = random.range(0, 2 * kPi), r = std::sqrt(1 - z * z);
    leaf.normal = {r * std::cos(azimuth), r * std::sin(azimuth), z};
  }
  return leaves;
}

TreeScan scan_tree(const TreeScanOptions& options) {
  SplitMix64 random(options.random_seed);
  TreeScan scan;
  const TreeGrowth growth = varied_growth(options.random_seed);
  scan.branches = grow_tree(growth, random);
  scan.tree_branches = scan.branches.size();
  scan.height = tree_height(scan.branches);
  scan.noise = options.noise;
  const std::vector<AxisBranch> tree = scan.branches;
  std::vector<AxisBranch> other;
  if (options.neighbour) {
    other = grow_neighbour(growth, options.random_seed, random);
    for (AxisBranch branch : other) {
      if (branch.parent != kNone) branch.parent += static_cast<Index>(tree.size());
      scan.branches.push_back(std::move(branch));
    }
  }
  if (options.leaves > 0) {
    scan.leaves = grow_leaves(tree, kMostLeaves, random);
    if (options.neighbour) {
      const std::vector<LeafDisc> more = grow_leaves(other, scan.leaves.size(), random);
      std::vector<LeafDisc> both;
      for (std::size_t l = 0; l < more.size(); ++l) both.insert(both.end(), {scan.leaves[l], more[l]});
      scan.leaves = std::move(both);
    }
  }

  Box box = TreeScene(scan.branches, {}).box();
  for (int k = 0; k < 3; ++k) box.lo[k] -= kLeafReach, box.hi[k] += kLeafReach;
  if (options.ground)
    for (int k = 0; k < 2; ++k) {
      box.lo[k] = std::min(box.lo[k], growth.base[k] - kGroundRadius);
      box.hi[k] = std::max(box.hi[k], growth.base[k] + kGroundRadius);
    }
  const std::vector<Sweep> sweeps = sweeps_of(options.path, tree, box, random);
  double pulses = 0;
  for (const Sweep& sweep : sweeps) pulses += sweep.pulses();
  double scale = std::sqrt(pulses / kPilotPulses);
  if (options.leaves > 0)
    scan.leaves.resize(count_leaves(options, scan.branches, scan.leaves, pilot_pulses(sweeps, scale, random)));

  const Scanner scanner(options, scan.branches, scan.tree_branches, scan.leaves, random.next());
  std::vector<Return> returns;
  for (int k = 0; k <= kScans; ++k) {
    returns = scanner.scan(sweeps, scale);
    const auto count = static_cast<double>(
        std::count_if(returns.begin(), returns.end(), [](const Return& echo) { return echo.of_tree; }));
    const double wanted = static_cast<double>(options.points);
    if (std::abs(count - wanted) < kCountError * wanted) break;
    if (count == 0) throw Error("the scanner does not see the tree; take another seed");
    scale *= std::sqrt(count / wanted);
  }
  for (const Return& echo : returns) {
    scan.points.push_back(echo.point);
    scan.origins.push_back(echo.origin);
    scan.kinds.push_back(echo.kind);
    scan.point_branches.push_back(echo.branch);
    scan.beam = std::max(scan.beam, echo.beam);
  }
  return scan;
}

}  // namespace bisector::test
