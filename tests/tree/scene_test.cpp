#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/tree.h"
#include "core/parallel.h"
#include "core/random.h"
#include "support/models.h"
#include "support/scene_score.h"
#include "support/tree_score.h"
#include "tree/ground.h"
#include "tree/part_trees.h"
#include "tree/walls.h"

namespace bisector {
namespace {

double gaussian(Random& random) {
  return std::sqrt(-2 * std::log(1 - random.uniform())) * std::cos(2 * std::numbers::pi * random.uniform());
}

std::vector<Vec3> cylinder(const Vec3& base, double radius, double height, std::size_t count, Random& random) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * random.uniform();
    points.push_back(base + Vec3{radius * std::cos(angle), radius * std::sin(angle), height * random.uniform()});
  }
  return points;
}

struct Terrain {
  double slope, bump;
  double height(double x, double y) const { return slope * x + bump * std::sin(1.5 * x) * std::cos(1.2 * y); }
};

// Points of a ground of 12 by 10 with noise, then of a trunk in its middle.
std::vector<Vec3> trunk_on(const Terrain& terrain, double noise, std::size_t ground, Random& random) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < ground; ++i) {
    const double x = 12 * random.uniform(), y = 10 * random.uniform();
    points.push_back({x, y, terrain.height(x, y) + noise * gaussian(random)});
  }
  for (const Vec3& p : cylinder({6, 5, terrain.height(6, 5)}, 0.2, 5, 3000, random)) points.push_back(p);
  return points;
}

TEST(Ground, IsFoundOnSlopesAndBumps) {
  for (const Terrain terrain : {Terrain{0, 0}, Terrain{0.6, 0}, Terrain{0.3, 0.2}}) {
    Random random(1);
    constexpr double kNoise = 0.01;
    const std::vector<Vec3> points = trunk_on(terrain, kNoise, 20'000, random);
    const Ground ground = find_ground(points, {});
    ASSERT_TRUE(ground.found);
    EXPECT_NEAR(ground.noise, kNoise, 0.3 * kNoise);
    std::size_t right = 0, eaten = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double above = points[i].z - terrain.height(points[i].x, points[i].y);
      if (i < 20'000) right += ground.is_ground[i];
      else if (above > 5 * kNoise) eaten += ground.is_ground[i];  // the foot of the trunk stays
    }
    EXPECT_GE(right, 19'700u);  // three deviations hold 99.7 %
    EXPECT_EQ(eaten, 0u);
    for (double x = 0.5; x < 12; x += 0.7)
      for (double y = 0.5; y < 10; y += 0.7)
        EXPECT_NEAR(ground.surface.at(x, y), terrain.height(x, y), 3 * kNoise) << x << ' ' << y;
  }
}

TEST(Ground, StraysBelowItDoNotDrawItDown) {
  Random random(2);
  std::vector<Vec3> points = trunk_on({0.2, 0}, 0.01, 8000, random);
  for (int k = 0; k < 5; ++k) points.push_back({1.0 + 2 * k, 2.0 + k, -3});
  const Ground ground = find_ground(points, {});
  ASSERT_TRUE(ground.found);
  EXPECT_NEAR(ground.surface.at(1, 2), 0.2, 0.03);
  EXPECT_EQ(std::count(ground.is_ground.end() - 5, ground.is_ground.end(), 1), 5);  // they are below it
}

TEST(Ground, OfAScanWithoutAnyIsNone) {
  std::uint64_t seed = 1;
  for (const auto path : {test::ScanPath::one_side, test::ScanPath::street, test::ScanPath::airborne})
    EXPECT_FALSE(find_ground(test::scan_tree({.path = path, .points = 5000, .random_seed = seed++}).points, {}).found);
  Random random(3);
  EXPECT_FALSE(find_ground(cylinder({0, 0, 0}, 0.1, 2, 4000, random), {}).found);
  std::vector<Vec3> wall;
  for (int i = 0; i < 4000; ++i) wall.push_back({8 * random.uniform(), 0.01 * gaussian(random), 4 * random.uniform()});
  EXPECT_FALSE(find_ground(wall, {}).found);
  EXPECT_FALSE(find_ground({}, {}).found);
}

TEST(Ground, IsWhatAFileSays) {
  Random random(4);
  const std::vector<Vec3> points = trunk_on({0.1, 0}, 0.01, 5000, random);
  std::vector<std::uint8_t> classes(points.size(), 1);
  for (std::size_t i = 0; i < 5000; i += 2) classes[i] = 2;
  const Ground ground = find_ground(points, classes);
  ASSERT_TRUE(ground.found);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(ground.is_ground[i] != 0, classes[i] == 2);
  EXPECT_NEAR(ground.surface.at(6, 5), 0.6, 0.03);
}

// A plane through (0, 0, 0), `rise` its angle off the vertical in radians.
std::vector<Vec3> plane(double width, double height, double rise, std::size_t count, Random& random) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = width * random.uniform(), t = height * random.uniform(), off = 0.01 * gaussian(random);
    points.push_back({x, t * std::sin(rise) + off * std::cos(rise), t * std::cos(rise) - off * std::sin(rise)});
  }
  return points;
}

std::size_t count_of(const Walls& walls, std::size_t first, std::size_t last) {
  return static_cast<std::size_t>(std::count_if(walls.wall.begin() + static_cast<std::ptrdiff_t>(first),
                                                walls.wall.begin() + static_cast<std::ptrdiff_t>(last),
                                                [](Index w) { return w != kNone; }));
}

TEST(Walls, AreLargeUprightPlanes) {
  constexpr double kHeight = 10;  // of the scan
  Random random(5);
  std::vector<Vec3> points = plane(9, 5, 0, 20'000, random);
  const std::size_t wall = points.size();
  for (const Vec3& p : cylinder({4, -2, 0}, 0.5, 6, 6000, random)) points.push_back(p);  // the stoutest trunk
  for (int i = 0; i < 6000; ++i)                                                         // a crown of leaves
    points.push_back({4 * random.uniform(), -5 + 3 * random.uniform(), 3 + 4 * random.uniform()});
  const Walls walls = find_walls(points, kHeight);
  EXPECT_EQ(walls.count, 1u);
  EXPECT_GE(count_of(walls, 0, wall), 0.98 * static_cast<double>(wall));
  EXPECT_EQ(count_of(walls, wall, points.size()), 0u);
}

TEST(Walls, AreNeitherSmallNorSlanting) {
  Random random(6);
  EXPECT_EQ(find_walls(plane(8, 1, 0, 10'000, random), 10).count, 0u);
  EXPECT_EQ(find_walls(plane(1, 8, 0, 10'000, random), 10).count, 0u);
  EXPECT_EQ(find_walls(plane(8, 6, 0.7, 20'000, random), 10).count, 0u);
  EXPECT_EQ(find_walls(plane(8, 6, 0, 20'000, random), 10).count, 1u);
  EXPECT_EQ(find_walls({}, 10).count, 0u);
}

std::vector<double> heights_of(const std::vector<Vec3>& points) {
  std::vector<double> heights;
  for (const Vec3& p : points) heights.push_back(p.z);
  return heights;
}

// Two trunks with a bough each that meet half way, and a bush between.
TEST(PartTrees, TouchingBoughsArePartedWhereTheyMeet) {
  Random random(7);
  std::vector<Vec3> points;
  const auto add = [&](const std::vector<Vec3>& more) { points.insert(points.end(), more.begin(), more.end()); };
  add(cylinder({0, 0, 0}, 0.15, 8, 2000, random));
  add(cylinder({4, 0, 0}, 0.15, 8, 2000, random));
  const std::size_t trunks = points.size();
  for (int i = 0; i < 800; ++i) points.push_back({4 * random.uniform(), 0.05 * gaussian(random), 5});
  const std::size_t boughs = points.size();
  for (int i = 0; i < 300; ++i)
    points.push_back({1.8 + 0.4 * random.uniform(), 0.4 * random.uniform() - 0.2, 0.8 * random.uniform()});
  const PartedTrees parted = part_trees(points, heights_of(points), true);
  ASSERT_EQ(parted.base.size(), 2u);
  for (std::size_t t = 0; t < 2; ++t) EXPECT_LT(points[parted.base[t]].z, 0.1);
  const Index left = parted.tree[0];
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i >= boughs) {
      EXPECT_EQ(parted.tree[i], kNone) << i;
      EXPECT_TRUE(parted.low[i]) << i;
    } else if (i < trunks) {
      EXPECT_EQ(parted.tree[i] == left, points[i].x < 2) << i;
    } else if (std::abs(points[i].x - 2) > 0.5) {
      EXPECT_EQ(parted.tree[i] == left, points[i].x < 2) << points[i].x;
    }
  }
}

TEST(PartTrees, WithoutAStemThereIsNone) {
  Random random(8);
  std::vector<Vec3> bush;
  for (int i = 0; i < 2000; ++i) bush.push_back({random.uniform(), random.uniform(), random.uniform()});
  EXPECT_TRUE(part_trees(bush, heights_of(bush), true).base.empty());
}

test::SceneScan small_scene(std::uint64_t seed, bool wall) {
  return test::scan_scene(
      {.trees = 3, .points = 20'000, .slope = 0.25, .bumps = 0.1, .wall = wall, .bushes = 2, .random_seed = seed});
}

TreeOptions scene_options() {
  TreeOptions options;
  options.scene = true;
  return options;
}

TEST(Scene, EveryPointIsOneThingAndEveryTreeIsFoundOnce) {
  for (const std::uint64_t seed : {61, 62}) {
    const test::SceneScan scan = small_scene(seed, seed % 2 == 0);
    const TreeResult result = reconstruct_tree(scan.points, scene_options());
    ASSERT_EQ(result.part.size(), scan.points.size());
    ASSERT_EQ(result.tree.size(), scan.points.size());
    std::vector<std::size_t> count(5, 0);
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      ++count[static_cast<std::size_t>(result.part[i])];
      EXPECT_EQ(result.tree[i] != kNone, result.part[i] == ScanPart::tree);
      if (result.branch[i] == kNone) continue;
      const ScannedTree& tree = result.trees[result.tree[i]];
      EXPECT_GE(result.branch[i], tree.trunk);
      EXPECT_LT(result.branch[i], tree.trunk + tree.branches);
    }
    EXPECT_EQ(count[1], result.ground_points);
    EXPECT_EQ(count[2], result.wall_points);
    EXPECT_EQ(count[3], result.low_plant_points);
    EXPECT_EQ(count[4], result.stray_points);
    EXPECT_EQ(result.walls, seed % 2 == 0 ? 1u : 0u);

    const test::SceneScore score = test::score_scene(scan, result);
    EXPECT_EQ(score.found_trees, 3u);
    EXPECT_GE(score.right_tree, 0.95);
    EXPECT_GE(score.ground.precision, 0.98);
    EXPECT_GE(score.ground.recall, 0.97);
    EXPECT_GE(score.wall.precision, 0.99);
    EXPECT_GE(score.wall.recall, 0.95);
    std::vector<Index> match = score.match;
    std::sort(match.begin(), match.end());
    EXPECT_EQ(match, (std::vector<Index>{0, 1, 2}));
    double volume = 0;
    for (std::size_t t = 0; t < 3; ++t) {
      const ScannedTree& tree = result.trees[score.match[t]];
      const Vec3 base = scan.branches[t][0].axis[0];
      const double off = std::hypot(tree.base.x - base.x, tree.base.y - base.y);
      EXPECT_LT(off, 0.4);
      EXPECT_NEAR(tree.ground, base.z, 0.02 + 0.4 * off);  // the steepest slope of this ground
      EXPECT_NEAR(tree.base.z, tree.ground, 0.05);
      std::vector<double> above;
      for (const Vec3& p : scan.tree_alone(static_cast<Index>(t)).points) above.push_back(p.z - base.z);
      std::sort(above.begin(), above.end());
      EXPECT_LE(tree.height, above.back() + 0.1);
      EXPECT_GE(tree.height, above[above.size() * 99 / 100] - 0.1);  // a point alone may be a stray
      volume += tree.volume;
    }
    double sum = 0;
    for (const TreeBranch& branch : result.branches) sum += branch.volume;
    EXPECT_NEAR(volume, sum, 1e-9 * sum);
  }
}

TEST(Scene, SameForAnyNumberOfThreads) {
  const test::SceneScan scan = small_scene(63, true);
  const TreeResult all = reconstruct_tree(scan.points, scene_options());
  const ThreadLimit limit(1);
  const TreeResult one = reconstruct_tree(scan.points, scene_options());
  EXPECT_EQ(one.part, all.part);
  EXPECT_EQ(one.tree, all.tree);
  EXPECT_EQ(one.branch, all.branch);
  ASSERT_EQ(one.skeleton.size(), all.skeleton.size());
  for (std::size_t k = 0; k < one.skeleton.size(); ++k) EXPECT_EQ(one.skeleton[k].position, all.skeleton[k].position);
}

TEST(Scene, WithoutGroundAndFarFromTheOriginTheTreesAreTheSame) {
  test::SceneScan scan =
      test::scan_scene({.trees = 2, .points = 5'000, .ground = false, .slope = 0.1, .random_seed = 64});
  TreeResult result = reconstruct_tree(scan.points, scene_options());
  EXPECT_EQ(result.ground_points, 0u);
  EXPECT_TRUE(std::isnan(result.trees[0].ground));
  const test::SceneScore score = test::score_scene(scan, result);
  EXPECT_EQ(score.found_trees, 2u);
  EXPECT_GE(score.right_tree, 0.95);
  for (Vec3& p : scan.points) p = 1024 * p + Vec3{0x1p19, 0x1p22, 0};
  result = reconstruct_tree(scan.points, scene_options());
  EXPECT_EQ(result.trees.size(), 2u);
}

// A tree on flat ground is the one without the ground, but for the points at its foot.
TEST(Scene, GroundUnderATreeIsLeftOut) {
  const test::TreeScan bare = test::scan_tree({.points = 4000, .random_seed = 65});
  const test::TreeScan scan = test::scan_tree({.points = 4000, .ground = true, .random_seed = 65});
  TreeOptions options;
  options.find_ground = true;
  const TreeResult result = reconstruct_tree(scan.points, options);
  std::size_t ground = 0, right = 0, eaten = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const bool is_ground = scan.kinds[i] == test::PointKind::ground, left = result.part[i] != ScanPart::tree;
    ground += is_ground;
    right += is_ground && left;
    eaten += !is_ground && left;
  }
  ASSERT_GT(ground, 200u);
  EXPECT_GE(right, 0.98 * static_cast<double>(ground));
  EXPECT_LE(eaten, 0.01 * static_cast<double>(scan.points.size() - ground));
  ASSERT_EQ(result.trees.size(), 1u);
  const double base = scan.branches[0].axis[0].z;
  EXPECT_NEAR(result.trees[0].ground, base, 0.03);
  EXPECT_NEAR(result.trees[0].height, scan.height, 0.1 * scan.height);
  const test::ScanScore with = test::score_scan(scan, test::axes_of(result)),
                        without = test::score_scan(bare, test::axes_of(reconstruct_tree(bare.points)));
  EXPECT_GE(static_cast<double>(with.right_parent) / static_cast<double>(with.branches),
            0.9 * static_cast<double>(without.right_parent) / static_cast<double>(without.branches));
}

TEST(Scene, WithoutGroundNothingIsLeftOut) {
  const test::TreeScan scan = test::scan_tree({.points = 3000, .random_seed = 66});
  TreeOptions options;
  options.find_ground = true;
  const TreeResult plain = reconstruct_tree(scan.points), found = reconstruct_tree(scan.points, options);
  EXPECT_EQ(found.ground_points + found.low_plant_points + found.stray_points, 0u);
  EXPECT_EQ(found.branch, plain.branch);
  ASSERT_EQ(found.skeleton.size(), plain.skeleton.size());
  for (std::size_t k = 0; k < plain.skeleton.size(); ++k)
    EXPECT_EQ(found.skeleton[k].position, plain.skeleton[k].position);
}

TEST(Scene, RefusesBadInput) {
  const auto message = [](const std::vector<Vec3>& points, const TreeOptions& options) -> std::string {
    try {
      reconstruct_tree(points, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  Random random(9);
  std::vector<Vec3> meadow;
  for (int i = 0; i < 4000; ++i) meadow.push_back({10 * random.uniform(), 10 * random.uniform(), 0});
  TreeOptions options = scene_options();
  EXPECT_NE(message(meadow, options).find("all 4000 points are ground"), std::string::npos);
  for (int i = 0; i < 400; ++i)
    meadow.push_back({5 + 3 * random.uniform(), 5 + 3 * random.uniform(), 0.2 + 2 * random.uniform()});
  EXPECT_NE(message(meadow, options).find("no tree found"), std::string::npos);
  options.components = TreeComponents::separate;
  EXPECT_NE(message(meadow, options).find("components"), std::string::npos);
  options = scene_options();
  options.classes = {2, 2};
  EXPECT_NE(message(meadow, options).find("2 classes"), std::string::npos);
}

}  // namespace
}  // namespace bisector
