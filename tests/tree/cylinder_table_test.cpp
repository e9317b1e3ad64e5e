#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/tree.h"
#include "core/geometry.h"
#include "support/tree_model.h"
#include "tree/frusta.h"

namespace bisector {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(Frusta, WithoutAParentAreTheSegments) {
  const std::vector<Frustum> frusta = frusta_outside({{0, 0, 0}, {0, 0, 3}, {0, 4, 6}}, {2, 1, 1});
  ASSERT_EQ(frusta.size(), 2u);
  EXPECT_EQ(frusta[0].height, 3);
  EXPECT_EQ(frusta[1].start, (Vec3{0, 0, 3}));
  EXPECT_EQ(frusta[1].segment, 1u);
  EXPECT_NEAR(frusta[0].volume(), kPi * (4 + 2 + 1), 1e-14);
  EXPECT_NEAR(frusta[0].lateral_area(), kPi * 3 * std::sqrt(10.0), 1e-14);
  EXPECT_NEAR(frusta[1].volume(), kPi * 5, 1e-14);
}

TEST(Frusta, BeginWhereTheAxisLeavesTheParent) {
  const std::vector<Vec3> trunk{{0, 0, 0}, {0, 0, 10}};
  // The surface of the parent, radius 1, is crossed in the second segment at x = 1, where the radius is 0.4.
  const std::vector<Frustum> frusta =
      frusta_outside({{0, 0, 5}, {0.5, 0, 5}, {1.5, 0, 5}, {3.5, 0, 5}}, {0.5, 0.5, 0.3, 0.1}, trunk, {1, 1});
  ASSERT_EQ(frusta.size(), 2u);
  EXPECT_EQ(frusta[0].segment, 1u);
  EXPECT_LE(norm(frusta[0].start - Vec3{1, 0, 5}), 1e-15);
  EXPECT_NEAR(frusta[0].height, 0.5, 1e-15);
  EXPECT_NEAR(frusta[0].start_radius, 0.4, 1e-15);
  EXPECT_EQ(frusta[1].height, 2);
  EXPECT_TRUE(frusta_outside({{0, 0, 5}, {0.5, 0, 5}}, {0.5, 0.5}, trunk, {1, 1}).empty());
}

struct Row {
  double radius, length;
  Vec3 start, axis;
  std::size_t parent, extension, branch, order, position, added;
};

class CylinderTable : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() / ("bisector_cylinders_" + std::to_string(::getpid()) + ".csv");
  }
  void TearDown() override { std::filesystem::remove(path_); }

  std::vector<Row> table(const TreeResult& tree) {
    write_cylinders(path_.string(), tree);
    std::ifstream in(path_);
    std::string line;
    std::getline(in, line);
    EXPECT_EQ(line,
              "radius,length,start_x,start_y,start_z,axis_x,axis_y,axis_z,parent,extension,branch,branch_order,"
              "position_in_branch,added");
    std::vector<Row> rows;
    while (std::getline(in, line)) {
      std::vector<std::string> words;
      std::istringstream words_of(line);
      for (std::string word; std::getline(words_of, word, ',');) words.push_back(word);
      EXPECT_EQ(words.size(), 14u) << line;
      if (words.size() != 14) break;
      const auto number = [&](std::size_t k) { return std::stod(words[k]); };
      const auto index = [&](std::size_t k) { return std::stoul(words[k]); };
      rows.push_back({number(0),
                      number(1),
                      {number(2), number(3), number(4)},
                      {number(5), number(6), number(7)},
                      index(8),
                      index(9),
                      index(10),
                      index(11),
                      index(12),
                      index(13)});
    }
    return rows;
  }

  std::filesystem::path path_;
};

// What holds for any tree.
void expect_sound(const std::vector<Row>& rows, const TreeResult& tree) {
  std::vector<double> volume(tree.branches.size(), 0), length(tree.branches.size(), 0);
  std::vector<std::size_t> last(tree.branches.size(), 0);  // row of each branch so far
  for (std::size_t i = 1; i <= rows.size(); ++i) {
    const Row& row = rows[i - 1];
    ASSERT_GE(row.branch, 1u);
    ASSERT_LE(row.branch, tree.branches.size());
    const TreeBranch& branch = tree.branches[row.branch - 1];
    EXPECT_EQ(row.order, static_cast<std::size_t>(branch.order));
    EXPECT_EQ(row.added, 0u);
    EXPECT_GT(row.radius, 0);
    EXPECT_GT(row.length, 0);
    EXPECT_NEAR(norm(row.axis), 1, 1e-15);
    ASSERT_LT(row.parent, i);  // a forest: no loops
    if (row.position == 1) {
      EXPECT_EQ(last[row.branch - 1], 0u);
      if (branch.parent == kNone) {
        EXPECT_EQ(row.parent, 0u);
      } else if (last[branch.parent] > 0) {
        ASSERT_GT(row.parent, 0u);
        EXPECT_EQ(rows[row.parent - 1].branch, branch.parent + 1);
      }
    } else {
      const Row& before = rows[row.parent - 1];
      EXPECT_EQ(row.parent, last[row.branch - 1]);
      EXPECT_EQ(before.branch, row.branch);
      EXPECT_EQ(before.position + 1, row.position);
      EXPECT_EQ(before.extension, i);
      EXPECT_LE(norm(before.start + before.length * before.axis - row.start), 1e-12 * (1 + norm(row.start)));
      EXPECT_LE(row.radius, before.radius * (1 + 1e-12));
    }
    if (row.extension != 0) {
      ASSERT_LE(row.extension, rows.size());
      EXPECT_EQ(rows[row.extension - 1].parent, i);
      EXPECT_EQ(rows[row.extension - 1].branch, row.branch);
    }
    last[row.branch - 1] = i;
    volume[row.branch - 1] += kPi * row.radius * row.radius * row.length;
    length[row.branch - 1] += row.length;
  }
  for (std::size_t b = 0; b < tree.branches.size(); ++b) {
    const TreeBranch& branch = tree.branches[b];
    EXPECT_NEAR(volume[b], branch.volume, 1e-9 * branch.volume) << b;
    EXPECT_LE(length[b], branch.length * (1 + 1e-9)) << b;
    if (branch.parent == kNone) {
      EXPECT_NEAR(length[b], branch.length, 1e-9 * branch.length);
    }
    if (last[b] > 0) {
      EXPECT_EQ(rows[last[b] - 1].extension, 0u);
    }
    if (branch.volume > 0) {
      EXPECT_GT(last[b], 0u);
    }
  }
}

TEST_F(CylinderTable, HasTheVolumeAndTheForkOfAReconstructedTree) {
  const TreeResult tree = reconstruct_tree(test::make_tree({.points = 8'000, .boughs = 4, .random_seed = 9}).points);
  ASSERT_GT(tree.branches.size(), 2u);
  const std::vector<Row> rows = table(tree);
  expect_sound(rows, tree);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    if (row.position != 1 || row.parent == 0) continue;
    // It grows out of the branch that it says: no farther off than the parent is thick there or the branch goes inside.
    const Row& parent = rows[row.parent - 1];
    const double along = std::clamp(dot(row.start - parent.start, parent.axis), 0.0, parent.length);
    const double inside = tree.branches[row.branch - 1].length;
    EXPECT_LE(norm(row.start - parent.start - along * parent.axis), parent.radius + inside) << i;
  }
}

TEST_F(CylinderTable, OfTreesThatStandApart) {
  std::vector<Vec3> points = test::make_tree({.points = 6'000, .boughs = 3, .random_seed = 1}).points;
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i) points.push_back(points[i] + Vec3{1e3, 0, 0});
  TreeOptions options;
  options.components = TreeComponents::separate;
  const TreeResult tree = reconstruct_tree(points, options);
  const std::vector<Row> rows = table(tree);
  expect_sound(rows, tree);
  std::size_t roots = 0;
  for (const Row& row : rows) roots += row.parent == 0;
  EXPECT_EQ(roots, 2u);
}

// A trunk, a stub that stays inside it, and a branch on the stub's end.
TEST_F(CylinderTable, WhatGrowsOnABranchWithoutCylindersGrowsOnItsParent) {
  TreeResult tree;
  tree.skeleton = {{{0, 0, 0}, 1, kNone, 0}, {{0, 0, 4}, 1, 0, 0},    {{0, 0, 4}, 1, 1, 0},
                   {{0, 0, 10}, 1, 2, 0},    {{0, 0, 5}, 0.5, 2, 1},  {{0.5, 0, 5}, 0.5, 4, 1},
                   {{0.5, 0, 5}, 0.2, 4, 2}, {{3.5, 0, 5}, 0.2, 6, 2}};
  tree.branches.resize(3);
  tree.branches[0].nodes = {0, 1, 2, 3};
  tree.branches[1].nodes = {4, 5};
  tree.branches[1].parent = 0;
  tree.branches[1].order = 1;
  tree.branches[2].nodes = {6, 7};
  tree.branches[2].parent = 1;
  tree.branches[2].order = 2;
  const std::vector<Row> rows = table(tree);
  ASSERT_EQ(rows.size(), 3u);  // a segment of no length has none
  EXPECT_EQ(rows[1].length, 6);
  EXPECT_EQ(rows[0].extension, 2u);
  EXPECT_EQ(rows[2].branch, 3u);
  EXPECT_EQ(rows[2].parent, 2u);
  EXPECT_EQ(rows[2].position, 1u);
  EXPECT_LE(norm(rows[2].axis - Vec3{1, 0, 0}), 1e-15);
  EXPECT_LE(norm(rows[2].start - Vec3{1, 0, 5}), 1e-15);
}

TEST_F(CylinderTable, OfNothingIsTheHead) {
  EXPECT_TRUE(table(TreeResult{}).empty());
  EXPECT_THROW(write_cylinders("/no/such/folder/a.csv", {}), Error);
}

}  // namespace
}  // namespace bisector
