#include "bisector/tree.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>
#include <numeric>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "core/random.h"
#include "mesh/topology.h"
#include "support/models.h"
#include "support/tree_model.h"
#include "support/tree_score.h"
#include "tree/coverage.h"

namespace bisector {
namespace {

using test::axes_of;

// What holds for any scan: no loops, radii that fall from parent to child and to the tip, every point counted once.
void expect_sound(const std::vector<Vec3>& points, const TreeResult& tree, std::size_t trunks = 1) {
  std::size_t roots = 0;
  for (std::size_t k = 0; k < tree.skeleton.size(); ++k) {
    const TreeNode& node = tree.skeleton[k];
    if (node.parent == kNone) ++roots;
    else ASSERT_LT(node.parent, k);  // no loops
    ASSERT_LT(node.branch, tree.branches.size());
    EXPECT_TRUE(std::isfinite(norm(node.position)));
    EXPECT_GT(node.radius, 0);
  }
  EXPECT_EQ(roots, trunks);
  std::vector<std::size_t> count(tree.branches.size(), 0);
  for (std::size_t b = 0; b < tree.branches.size(); ++b) {
    const TreeBranch& branch = tree.branches[b];
    ASSERT_GE(branch.nodes.size(), 2u);
    if (branch.parent == kNone) {
      EXPECT_EQ(branch.order, 0);
    } else {
      ASSERT_LT(branch.parent, b);
      EXPECT_EQ(branch.order, tree.branches[branch.parent].order + 1);
      EXPECT_EQ(tree.skeleton[tree.skeleton[branch.nodes[0]].parent].branch, branch.parent);
    }
    for (std::size_t k = 1; k < branch.nodes.size(); ++k) {
      EXPECT_EQ(tree.skeleton[branch.nodes[k]].parent, branch.nodes[k - 1]);
      EXPECT_LE(tree.skeleton[branch.nodes[k]].radius, tree.skeleton[branch.nodes[k - 1]].radius * (1 + 1e-12));
    }
    EXPECT_GT(branch.length, 0);
    EXPECT_GE(branch.fitted_length, 0);
    EXPECT_LE(branch.fitted_length, branch.length * (1 + 1e-12));
    EXPECT_GE(branch.volume, 0);
    if (branch.parent != kNone) {
      EXPECT_LE(branch.base_radius, tree.branches[branch.parent].base_radius * (1 + 1e-9)) << "branch " << b;
    }
  }
  ASSERT_EQ(tree.branch.size(), points.size());
  ASSERT_EQ(tree.cluster.size(), points.size());
  for (const Index b : tree.branch)
    if (b != kNone) {
      ASSERT_LT(b, tree.branches.size());
      ++count[b];
    }
  std::size_t assigned = 0;
  for (std::size_t b = 0; b < count.size(); ++b) assigned += count[b];
  EXPECT_EQ(assigned + tree.ground_points + tree.small_component_points + tree.unexplained_points, points.size());
}

std::vector<Vec3> cylinder(const Vec3& base, double radius, double height, std::size_t count, std::uint64_t seed = 1) {
  Random random(seed);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * random.uniform(), z = height * random.uniform();
    points.push_back(base + Vec3{radius * std::cos(angle), radius * std::sin(angle), z});
  }
  return points;
}

TEST(Tree, OfACylinderIsOneBranch) {
  const std::vector<Vec3> points = cylinder({3, 4, 5}, 0.1, 2, 5000);
  const TreeResult tree = reconstruct_tree(points);
  expect_sound(points, tree);
  ASSERT_EQ(tree.branches.size(), 1u);
  EXPECT_NEAR(tree.branches[0].length, 2, 0.25);
  EXPECT_NEAR(tree.branches[0].base_radius, 0.1, 0.01);
  EXPECT_NEAR(tree.branches[0].tip_radius, 0.1, 0.01);
  EXPECT_NEAR(tree.branches[0].volume, std::numbers::pi * 0.01 * tree.branches[0].length,
              0.1 * tree.branches[0].volume);
}

TEST(Tree, FindsTheBranchesOfAKnownTree) {
  const test::TreeModel model = test::make_tree({.random_seed = 1});
  const TreeResult tree = reconstruct_tree(model.points);
  expect_sound(model.points, tree);
  const test::TreeScore score = test::score_tree(model.branches, axes_of(tree), model.noise, 1);
  ASSERT_GE(score.branches, 60u);
  EXPECT_GE(static_cast<double>(score.right_parent), 0.9 * static_cast<double>(score.branches));
  EXPECT_LT(score.radius_error, 0.15);
  EXPECT_LT(score.axis_mean, 0.5);
  EXPECT_FALSE(score.loops);
  EXPECT_EQ(score.roots, 1u);
  EXPECT_NEAR(tree.noise, model.noise, 0.4 * model.noise);
}

TEST(Tree, FindsThemWithoutNoiseAndOcclusion) {
  const test::TreeModel model = test::make_tree({.points = 40'000, .noise = 0, .occlusion = 0, .random_seed = 2});
  const TreeResult tree = reconstruct_tree(model.points);
  expect_sound(model.points, tree);
  const test::TreeScore score = test::score_tree(model.branches, axes_of(tree), 0.002 * model.height);
  EXPECT_GE(static_cast<double>(score.right_parent), 0.9 * static_cast<double>(score.branches));
  EXPECT_LT(score.radius_error, 0.1);
}

TEST(Tree, SurfacesAreClosedAndCoverThePoints) {
  const test::TreeModel model = test::make_tree({.points = 30'000, .boughs = 6, .random_seed = 3});
  const TreeResult tree = reconstruct_tree(model.points);
  const TriangleMesh mesh = tree_mesh(tree);
  ASSERT_EQ(mesh.labels.size(), mesh.triangles.size());
  std::vector<std::vector<Triangle>> parts(tree.branches.size());
  std::vector<BranchSurface> surfaces;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    parts[static_cast<std::size_t>(mesh.labels[t])].push_back(mesh.triangles[t]);
  }
  for (std::size_t b = 0; b < parts.size(); ++b) {
    const MeshTopology topology = analyse_topology(parts[b], mesh.vertices.size());
    EXPECT_TRUE(topology.closed && topology.manifold && topology.oriented) << "branch " << b;
    surfaces.push_back(tree.branches[b].surface);
  }
  EXPECT_GE(share_within(cover_points(model.points, surfaces, mesh), 0.01 * model.height), 0.95);
}

TEST(Tree, SameForAnyNumberOfThreads) {
  const test::TreeModel model = test::make_tree({.points = 15'000, .boughs = 5, .random_seed = 4});
  const TreeResult all = reconstruct_tree(model.points);
  const ThreadLimit limit(1);
  const TreeResult one = reconstruct_tree(model.points);
  EXPECT_EQ(one.branch, all.branch);
  ASSERT_EQ(one.skeleton.size(), all.skeleton.size());
  for (std::size_t k = 0; k < one.skeleton.size(); ++k) {
    EXPECT_EQ(one.skeleton[k].position, all.skeleton[k].position);
    EXPECT_EQ(one.skeleton[k].radius, all.skeleton[k].radius);
  }
}

// In another unit and far from the origin, as in UTM, the tree is the same.
TEST(Tree, UnitAndOriginDoNotMatter) {
  const test::TreeModel model = test::make_tree({.points = 15'000, .boughs = 5, .random_seed = 5});
  const TreeResult tree = reconstruct_tree(model.points);
  std::vector<Vec3> moved = model.points;
  for (Vec3& p : moved) p = 1024 * p + Vec3{0x1p19, 0x1p22, 0};
  const TreeResult other = reconstruct_tree(moved);
  expect_sound(moved, other);
  const std::size_t same =
      static_cast<std::size_t>(std::inner_product(tree.branch.begin(), tree.branch.end(), other.branch.begin(), 0,
                                                  std::plus<>(), [](Index a, Index b) { return a == b; }));
  EXPECT_GT(same, moved.size() * 9 / 10);
  EXPECT_NEAR(static_cast<double>(other.branches.size()), static_cast<double>(tree.branches.size()), 2);
  EXPECT_NEAR(other.branches[0].length, 1024 * tree.branches[0].length, 20 * tree.branches[0].length);
}

TEST(Tree, DuplicatesCountOnce) {
  const test::TreeModel model = test::make_tree({.points = 10'000, .boughs = 4, .random_seed = 6});
  std::vector<Vec3> points = model.points;
  for (std::size_t i = 0; i < model.points.size(); i += 2)
    for (int k = 0; k < 10; ++k) points.push_back(model.points[i]);
  const TreeResult once = reconstruct_tree(model.points), often = reconstruct_tree(points);
  expect_sound(points, often);
  EXPECT_EQ(often.duplicate_points, points.size() - model.points.size());
  EXPECT_EQ(often.skeleton.size(), once.skeleton.size());
  for (std::size_t i = 0; i < model.points.size(); ++i) EXPECT_EQ(often.branch[i], once.branch[i]);
  EXPECT_EQ(often.branch[model.points.size()], often.branch[0]);
}

TEST(Tree, GroundIsLeftOut) {
  std::vector<Vec3> points = cylinder({0, 0, 0}, 0.1, 2, 4000);
  const std::size_t trunk = points.size();
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    const double x = 4 * random.uniform() - 2, y = 4 * random.uniform() - 2;
    points.push_back({x, y, -0.01 * random.uniform() - 0.001});
  }
  std::vector<std::string> warnings;
  Context context;
  context.warning = [&](const std::string& line) { warnings.push_back(line); };
  expect_sound(points, reconstruct_tree(points, {}, context));
  EXPECT_EQ(warnings.size(), 1u);  // it looks like ground
  TreeOptions options;
  options.ground = 0;
  warnings.clear();
  const TreeResult tree = reconstruct_tree(points, options, context);
  expect_sound(points, tree);
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(tree.ground_points, points.size() - trunk);
  EXPECT_EQ(tree.branches.size(), 1u);
  EXPECT_EQ(tree.branch.back(), kNone);
}

TEST(Tree, ComponentsAreBridgedOrApart) {
  std::vector<Vec3> points = cylinder({0, 0, 0}, 0.05, 1, 3000);
  for (const Vec3& p : cylinder({0, 0, 1.2}, 0.05, 1, 3000, 2)) points.push_back(p);
  for (int i = 0; i < 12; ++i) points.push_back({3 + 0.001 * i, 0.0002 * i * i, 1});
  const TreeResult bridged = reconstruct_tree(points);
  expect_sound(points, bridged);
  EXPECT_EQ(bridged.components, 3u);
  ASSERT_EQ(bridged.bridges.size(), 2u);
  EXPECT_NEAR(bridged.bridges[0], 0.2, 0.05);
  double longest = 0;
  for (const TreeBranch& b : bridged.branches) longest = std::max(longest, b.length);
  EXPECT_GT(longest, 2);  // straight on over the gap
  TreeOptions options;
  options.components = TreeComponents::separate;
  const TreeResult apart = reconstruct_tree(points, options);
  expect_sound(points, apart, 2);
  EXPECT_EQ(apart.small_component_points, 12u);
  EXPECT_TRUE(apart.bridges.empty());
}

TEST(Tree, ClustersAreBounded) {
  const test::TreeModel model = test::make_tree({.points = 15'000, .boughs = 5, .random_seed = 7});
  TreeOptions options;
  options.clusters = 60;
  const TreeResult tree = reconstruct_tree(model.points, options);
  expect_sound(model.points, tree);
  EXPECT_LE(tree.clusters, 60u);
  options.clusters = 0;
  options.max_cluster_points = 40;
  EXPECT_GT(reconstruct_tree(model.points, options).clusters, 200u);
}

TEST(Tree, OddCloudsAreNoFailure) {
  Random random(8);
  std::vector<std::vector<Vec3>> clouds(4);
  for (int i = 0; i < 500; ++i) {
    const double x = random.uniform(), y = random.uniform(), z = random.uniform();
    clouds[0].push_back({x, y, 0});                       // a horizontal plane
    clouds[1].push_back({x, 0, z});                       // a vertical one
    clouds[2].push_back({x, y, z});                       // a box full
    clouds[3].push_back({x + (i % 2 ? 1000 : 0), y, z});  // two, far apart
  }
  std::vector<Vec3> few;
  for (int c = 0; c < 12; ++c)
    for (int i = 0; i < 5; ++i) few.push_back({3.0 * c, random.uniform(), 2.0 * c + random.uniform()});
  clouds.push_back(few);
  clouds.emplace_back();
  for (int i = 0; i < 20; ++i) clouds.back().push_back({random.uniform(), random.uniform(), random.uniform()});
  for (const auto& cloud : clouds) {
    const TreeResult tree = reconstruct_tree(cloud);
    expect_sound(cloud, tree);
    EXPECT_FALSE(tree_mesh(tree).triangles.empty());
  }
}

TEST(Tree, RefusesBadInput) {
  const auto message = [](const std::vector<Vec3>& points, const TreeOptions& options = {}) -> std::string {
    try {
      reconstruct_tree(points, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  std::vector<Vec3> points = cylinder({0, 0, 0}, 0.1, 1, 100);
  EXPECT_NE(message({}).find("too few"), std::string::npos);
  EXPECT_NE(message({points.begin(), points.begin() + 19}).find("too few"), std::string::npos);
  EXPECT_NE(message(std::vector<Vec3>(1000, Vec3{1, 2, 3})).find("too few"), std::string::npos);
  std::vector<Vec3> line;
  for (int i = 0; i < 100; ++i) line.push_back({0.1 * i + 1e6, 0.2 * i, 0.3 * i});
  EXPECT_NE(message(line).find("one line"), std::string::npos);
  TreeOptions options;
  options.ground = 5;
  EXPECT_NE(message(points, options).find("below the ground"), std::string::npos);
  options.ground = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message(points, options).find("ground"), std::string::npos);
  options = {};
  for (const double delta : {0.0, -1.0, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    options.delta = delta;
    EXPECT_NE(message(points, options).find("delta"), std::string::npos);
  }
  points[17].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message(points).find("point 17"), std::string::npos);
}

TEST(Tree, StopsWhenAsked) {
  const std::atomic<bool> cancel = true;
  Context context;
  context.cancel = &cancel;
  EXPECT_THROW(reconstruct_tree(cylinder({0, 0, 0}, 0.1, 1, 500), {}, context), Cancelled);
}

class TreeFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("bisector_tree_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    points_ = test::make_tree({.points = 8'000, .boughs = 4, .random_seed = 9}).points;
    tree_ = reconstruct_tree(points_);
    mesh_ = tree_mesh(tree_, 0.2);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const char* name) const { return (folder_ / name).string(); }

  std::filesystem::path folder_;
  std::vector<Vec3> points_;
  TreeResult tree_;
  TriangleMesh mesh_;
};

TEST_F(TreeFiles, ReadBack) {
  ASSERT_GT(tree_.branches.size(), 2u);
  for (const char* name : {"tree.obj", "tree.ply"}) {
    write_tree(path(name), tree_, mesh_);
    const TriangleMesh read = read_mesh(path(name));
    EXPECT_EQ(read.triangles, mesh_.triangles) << name;
    EXPECT_EQ(read.vertices, mesh_.vertices) << name;
    EXPECT_EQ(read.labels, mesh_.labels) << name;
  }
  std::ifstream obj(path("tree.obj"));
  const std::string text{std::istreambuf_iterator<char>(obj), {}};
  EXPECT_NE(text.find("g branch_0\n"), std::string::npos);
  EXPECT_NE(text.find("g branch_" + std::to_string(tree_.branches.size() - 1) + "\n"), std::string::npos);
  write_tree(path("tree.igs"), tree_, mesh_, IgesUnit::millimetre);
  EXPECT_GT(std::filesystem::file_size(path("tree.igs")), 1000u);
}

TEST_F(TreeFiles, LabelsAndSkeletonAreOfThePoints) {
  write_tree_labels(path("labels.ply"), points_, tree_);
  EXPECT_EQ(read_points(path("labels.ply")), points_);
  const std::vector<double> labels = read_vertex_attribute(path("labels.ply"), "label");
  for (std::size_t i = 0; i < points_.size(); ++i)
    EXPECT_EQ(labels[i], tree_.branch[i] == kNone ? -1.0 : static_cast<double>(tree_.branch[i]));
  write_skeleton(path("skeleton.ply"), tree_);
  const std::vector<Vec3> nodes = read_points(path("skeleton.ply"));
  const std::vector<double> radii = read_vertex_attribute(path("skeleton.ply"), "radius");
  ASSERT_EQ(nodes.size(), tree_.skeleton.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    EXPECT_EQ(nodes[k], tree_.skeleton[k].position);
    EXPECT_EQ(radii[k], tree_.skeleton[k].radius);
  }
  EXPECT_THROW(write_tree_labels(path("labels.ply"), {}, tree_), Error);
}

TEST(Tree, RealScanIsCovered) {
  const std::string path = test::shared_scan("tree7.xyz");
  if (path.empty()) GTEST_SKIP() << "no scans here";
  const std::vector<Vec3> points = read_points(path);
  const TreeResult tree = reconstruct_tree(points);
  expect_sound(points, tree);
  std::vector<BranchSurface> surfaces;
  for (const TreeBranch& b : tree.branches) surfaces.push_back(b.surface);
  const Box box = bounding_box(points);
  EXPECT_GE(share_within(cover_points(points, surfaces, tree_mesh(tree)), 0.01 * (box.hi.z - box.lo.z)), 0.93);
}

}  // namespace
}  // namespace bisector
