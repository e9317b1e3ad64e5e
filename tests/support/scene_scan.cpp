#include "support/scene_scan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "support/tree_scene.h"

namespace bisector::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNothing = std::numeric_limits<double>::infinity();
constexpr double kCarHeight = 2;        // m
constexpr double kProfileDistance = 3;  // of the car's profiles, in the distance of points on them
constexpr double kMargin = 3;           // of the ground around the trees, m
constexpr double kWallHeight = 6;       // m
constexpr double kBreadth = 0.45;       // of a crown to one side, of the tree's height: wide enough for all
constexpr std::size_t kBushLeaves = 250;
constexpr std::size_t kPilotPulses = 10'000;
constexpr std::size_t kGrain = 4096;  // pulses of a chunk

// A plane with bumps: the same formula everywhere, so that rays can be traced.
class Terrain {
 public:
  Terrain(const SceneScanOptions& options, SplitMix64& random) {
    const double azimuth = random.range(0, 2 * kPi);
    slope_ = options.slope * Vec3{std::cos(azimuth), std::sin(azimuth), 0};
    for (Wave& wave : waves_) {
      const double turn = random.range(0, 2 * kPi), length = random.range(2, 6);
      wave = {2 * kPi / length * Vec3{std::cos(turn), std::sin(turn), 0}, random.range(0, 2 * kPi),
              0.5 * options.bumps / std::sqrt(static_cast<double>(waves_.size()))};
      steepest_ += wave.height * norm(wave.along);
    }
    steepest_ += norm(slope_);
  }

  double height(const Vec3& p) const {
    double z = dot(slope_, p);
    for (const Wave& wave : waves_) z += wave.height * std::sin(dot(wave.along, p) + wave.phase);
    return z;
  }

  // Sphere tracing: no step can pass the ground.
  double hit(const Vec3& origin, const Vec3& direction, double farthest) const {
    double range = 0;
    const double fall = steepest_ * std::hypot(direction.x, direction.y) - direction.z;
    if (!(fall > 0)) return kNothing;
    for (int k = 0; k < 400 && range < farthest; ++k) {
      const Vec3 p = origin + range * direction;
      const double above = p.z - height(p);
      if (above < 1e-5) return range;
      range += above / fall;
    }
    return kNothing;
  }

 private:
  struct Wave {
    Vec3 along;
    double phase = 0, height = 0;
  };
  Vec3 slope_;
  std::array<Wave, 5> waves_;
  double steepest_ = 0;
};

struct Echo {
  Vec3 point;
  ScenePoint kind = ScenePoint::tree;
  Index branch = kNone, leaf = kNone;  // of all trees
};

struct Scene {
  const SceneScanOptions& options;
  Terrain terrain;
  TreeScene solids;  // branches, leaves of trees and of bushes
  std::size_t tree_leaves = 0;
  double first = 0, last = 0;            // along the street, x
  double street = 0, wall = 0, far = 0;  // y

  bool answer(const Vec3& origin, const Vec3& direction, SplitMix64& random, Echo& echo) const {
    const Vec3 drawn = unit(direction + 0.5 * options.divergence * std::sqrt(random.unit()) *
                                            across(direction, random.range(0, 2 * kPi)));
    const SceneHit hit = solids.first_hit(origin, drawn);
    double range = hit.range;
    echo.kind = hit.leaf != kNone && hit.leaf >= tree_leaves ? ScenePoint::bush : ScenePoint::tree;
    echo.branch = hit.branch;
    echo.leaf = hit.leaf;
    const auto nearer = [&](double other, ScenePoint kind) {
      if (!(other < range)) return;
      range = other;
      echo.kind = kind;
      echo.branch = echo.leaf = kNone;
    };
    if (options.wall && drawn.y > 0) {
      const double to_wall = (wall - origin.y) / drawn.y;
      const Vec3 p = origin + to_wall * drawn;
      if (p.x > first && p.x < last && p.z < terrain.height(p) + kWallHeight && p.z > terrain.height(p))
        nearer(to_wall, ScenePoint::wall);
    }
    if (options.ground)
      if (const double to_ground = terrain.hit(origin, drawn, std::min(range, 60.0)); to_ground < range) {
        const Vec3 p = origin + to_ground * drawn;
        if (p.y < far && p.y > street + 2 && p.x > first && p.x < last) nearer(to_ground, ScenePoint::ground);
        else return false;
      }
    if (!std::isfinite(range)) return false;
    echo.point = origin + (range + options.noise * gaussian(random)) * direction;
    return true;
  }
};

void add_bush(const Vec3& base, SplitMix64& random, std::vector<LeafDisc>& leaves) {
  const double radius = random.range(0.2, 0.5);
  for (std::size_t k = 0; k < kBushLeaves; ++k) {
    const auto direction = [&] {
      const double z = random.range(-1, 1), azimuth = random.range(0, 2 * kPi), r = std::sqrt(1 - z * z);
      return Vec3{r * std::cos(azimuth), r * std::sin(azimuth), z};
    };
    const Vec3 centre = base + Vec3{0, 0, radius} + radius * std::cbrt(random.unit()) * direction();
    leaves.push_back({centre, direction(), random.range(0.02, 0.04)});
  }
}

}  // namespace

TreeScan SceneScan::tree_alone(Index tree) const {
  TreeScan scan;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (trees[i] != tree) continue;
    scan.points.push_back(points[i]);
    scan.kinds.push_back(point_branches[i] == kNone ? PointKind::leaf : PointKind::wood);
    scan.point_branches.push_back(point_branches[i]);
  }
  scan.branches = branches[tree];
  scan.tree_branches = scan.branches.size();
  scan.height = tree_height(scan.branches);
  scan.noise = noise;
  scan.beam = beam;
  return scan;
}

SceneScan scan_scene(const SceneScanOptions& options) {
  SplitMix64 random(options.random_seed);
  SceneScan scan;
  scan.noise = options.noise;
  const Terrain terrain(options, random);
  const auto on_ground = [&](double x, double y) { return Vec3{x, y, terrain.height({x, y, 0})}; };

  std::vector<AxisBranch> all;
  std::vector<LeafDisc> leaves;
  std::vector<std::pair<Index, Index>> name;  // tree, branch in it
  double x = 0, breadth = 0, top = 0;
  for (std::size_t t = 0; t < options.trees; ++t) {
    TreeGrowth growth = varied_growth(random.next());
    growth.base = on_ground(x, random.range(-0.5, 0.5));
    scan.branches.push_back(grow_tree(growth, random));
    const std::vector<LeafDisc> own = grow_leaves(scan.branches.back(), options.leaves, random);
    leaves.insert(leaves.end(), own.begin(), own.end());
    breadth = std::max(breadth, kBreadth * growth.height);
    const auto first = static_cast<Index>(all.size());
    for (std::size_t b = 0; b < scan.branches.back().size(); ++b) {
      AxisBranch branch = scan.branches.back()[b];
      if (branch.parent != kNone) branch.parent += first;
      for (const Vec3& p : branch.axis) top = std::max(top, p.z);
      all.push_back(std::move(branch));
      name.emplace_back(static_cast<Index>(t), static_cast<Index>(b));
    }
    if (t + 1 < options.trees) x += options.apart * random.range(0.8, 1.2);
  }
  const std::size_t tree_leaves = leaves.size();
  for (std::size_t k = 0; k < options.bushes; ++k)
    add_bush(on_ground(random.range(-1, x + 1), random.range(-1.5, 1.5)), random, leaves);

  const double distance = random.range(5, 8);
  const Scene scene{.options = options,
                    .terrain = terrain,
                    .solids = TreeScene(all, leaves),
                    .tree_leaves = tree_leaves,
                    .first = -breadth - kMargin,
                    .last = x + breadth + kMargin,
                    .street = -distance,
                    .wall = random.range(2, 3.5),
                    .far = options.wall ? 4 : breadth + kMargin};
  const double low = -70 * kRadiansPerDegree, high = std::atan2(top, std::max(distance - breadth, 1.0));
  const auto scan_with = [&](double step) {  // angle between the pulses of a profile
    const auto columns = static_cast<std::size_t>((scene.last - scene.first) / (kProfileDistance * distance * step)),
               rows = static_cast<std::size_t>((high - low) / step);
    std::vector<std::vector<Echo>> chunks((columns * rows + kGrain - 1) / kGrain);
    parallel_chunks(columns * rows, kGrain, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        SplitMix64 own(SplitMix64(options.random_seed ^ (i << 8)).next());
        const double u = (static_cast<double>(i / rows) + own.range(0.25, 0.75)) / static_cast<double>(columns),
                     v = (static_cast<double>(i % rows) + own.range(0.25, 0.75)) / static_cast<double>(rows);
        const double angle = low + v * (high - low), at = scene.first + u * (scene.last - scene.first);
        const Vec3 origin{at, scene.street, terrain.height({at, scene.street, 0}) + kCarHeight};
        Echo echo;
        if (scene.answer(origin, {0, std::cos(angle), std::sin(angle)}, own, echo)) chunks[chunk].push_back(echo);
      }
    });
    std::vector<Echo> echoes;
    for (const std::vector<Echo>& chunk : chunks) echoes.insert(echoes.end(), chunk.begin(), chunk.end());
    return echoes;
  };
  double step = std::sqrt((scene.last - scene.first) * (high - low) / (kProfileDistance * distance * kPilotPulses));
  const auto pilot = static_cast<double>(scan_with(step).size());
  step *= std::sqrt(pilot / static_cast<double>(options.points));
  for (const Echo& echo : scan_with(step)) {
    scan.points.push_back(echo.point);
    scan.kinds.push_back(echo.kind);
    const bool is_wood = echo.branch != kNone, is_leaf = echo.kind == ScenePoint::tree && !is_wood;
    scan.trees.push_back(is_wood   ? name[echo.branch].first
                         : is_leaf ? static_cast<Index>(echo.leaf / options.leaves)
                                   : kNone);
    scan.point_branches.push_back(is_wood ? name[echo.branch].second : kNone);
  }
  scan.beam = 0.5 * options.divergence * (distance + breadth);
  return scan;
}

}  // namespace bisector::test
