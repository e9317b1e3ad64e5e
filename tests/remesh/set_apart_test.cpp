// Components that touch, cross or lie in each other are remeshed as if each were alone.
#include "remesh/set_apart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "bisector/distance_bound.h"
#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "mesh/topology.h"
#include "support/models.h"
#include "support/scaled.h"

namespace bisector::test {
namespace {

TriangleMesh component_of(const TriangleMesh& mesh, Index which) {
  const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  TriangleMesh part;
  part.vertices = mesh.vertices;
  for (const Triangle& t : mesh.triangles)
    if (component[t[0]] == which) part.triangles.push_back(t);
  return part;
}

std::vector<double> constant(const TriangleMesh& mesh, double length) {
  return std::vector<double>(mesh.vertices.size(), length);
}

// Two closed surfaces that are near to each other.
struct Pair {
  std::string name;
  TriangleMesh first, second;
  Vec3 offset;  // of the second
};

void PrintTo(const Pair& pair, std::ostream* out) { *out << pair.name; }

std::vector<Pair> pairs() {
  const TriangleMesh slab = scaled(box(1), {2, 2, 1});
  return {{"on_each_other", slab, box(1), {0.5, 0.5, 1}},
          {"with_a_face_in_common", slab, slab, {0, 0, 1}},
          {"side_by_side_in_a_plane", slab, scaled(box(1), {2, 1, 0.5}), {1, 0.5, 0.5}},
          {"with_two_coplanar_faces", slab, scaled(box(1), {1, 1, 2}), {0.5, 0.5, 0}},
          {"the_same_twice", box(2), box(2), {0, 0, 0}},
          {"crossing", icosphere(3), icosphere(3), {0.7, 0.2, 0.1}},
          {"in_each_other", icosphere(4), scaled(icosphere(4), {0.98, 0.98, 0.98}), {0, 0, 0}}};
}

class TwoComponents : public testing::TestWithParam<Pair> {};

TEST_P(TwoComponents, AreRemeshedAsIfEachWereAlone) {
  const Pair& pair = GetParam();
  const TriangleMesh input = joined(pair.first, pair.second, pair.offset);
  RemeshOptions options;
  options.vertices = 900;
  const RemeshResult result = remesh(input, options);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_LE(result.mesh.vertices.size(), 909u);
  EXPECT_GE(measure_quality(result.mesh).theta_min, 30);
  ASSERT_EQ(result.topology.components, 2u);
  // In which order components are in a result is not said.
  const std::array parts{component_of(result.mesh, 0), component_of(result.mesh, 1)};
  const std::array inputs{component_of(input, 0), component_of(input, 1)};
  std::array<std::array<double, 2>, 2> off{};
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t i = 0; i < 2; ++i) off[k][i] = bound_hausdorff_distance(parts[k], inputs[i], 1e-3, {}).upper;
  const bool swapped = std::max(off[0][1], off[1][0]) < std::max(off[0][0], off[1][1]);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_LT(off[k][swapped ? 1 - k : k], 0.05);
}

INSTANTIATE_TEST_SUITE_P(All, TwoComponents, testing::ValuesIn(pairs()), [](const auto& p) { return p.param.name; });

TEST(SetApart, MovesComponentsOutOfEachOthersReach) {
  // Nine boxes about each other take more places than one axis has.
  TriangleMesh mesh;
  for (int k = 0; k < 9; ++k) mesh = joined(std::move(mesh), box(1), {0.1 * k, 0.05 * k, 0.02 * k});
  const double edge = 0.125;
  const SetApart apart(mesh, constant(mesh, edge), 900);
  ASSERT_FALSE(apart.empty());
  TriangleMesh moved = mesh;
  apart.move(moved);
  std::vector<Box> boxes;
  for (Index c = 0; c < 9; ++c) {
    const TriangleMesh part = component_of(moved, c);
    boxes.push_back(bounding_box(part.vertices, part.triangles));
  }
  for (std::size_t i = 0; i < 9; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      double gap = 0;
      for (int k = 0; k < 3; ++k)
        gap = std::max({gap, boxes[i].lo[k] - boxes[j].hi[k], boxes[j].lo[k] - boxes[i].hi[k]});
      EXPECT_GE(gap, edge);
    }
  for (Index v = 0; v < mesh.vertices.size(); ++v) {
    EXPECT_LE(norm(apart.back(moved.vertices[v]) - mesh.vertices[v]), 1e-15);
    EXPECT_EQ(apart.back(mesh.vertices[v]), mesh.vertices[v]);
  }
}

TEST(SetApart, LeavesWhatIsFarFromEachOther) {
  const TriangleMesh far = joined(box(1), box(1), {1.25, 0, 0}), near = joined(box(1), box(1), {1.0625, 0, 0});
  EXPECT_TRUE(SetApart(far, constant(far, 0.125), 900).empty());
  EXPECT_FALSE(SetApart(near, constant(near, 0.125), 900).empty());
  EXPECT_TRUE(SetApart(box(4), constant(box(4), 0.125), 900).empty());
}

TEST(SetApart, LeavesASoup) {
  const TriangleMesh mesh = soup(200, 1);
  EXPECT_TRUE(SetApart(mesh, constant(mesh, 0.1), 1500).empty());
  EXPECT_FALSE(SetApart(mesh, constant(mesh, 0.1), 2000).empty());
}

// What is moved back is where it was: corners to the bit, and kept vertices as well.
TEST(SetApart, KeepsCornersAndKeptVertices) {
  TriangleMesh input = joined(scaled(box(1), {1, 0.3, 0.7}), scaled(box(2), {0.4, 0.9, 1.1}), {0.1, 0.1, 0.1});
  for (Vec3& p : input.vertices) p += Vec3{1.0 / 3, 1e3 / 7, -1.0 / 9};
  RemeshOptions options;
  options.vertices = 700;
  for (const bool keeps : {false, true}) {
    if (keeps) options.keep_vertices = {20, 25};
    const RemeshResult result = remesh(input, options);
    std::size_t corners = 0;
    for (Index v = 0; v < result.mesh.vertices.size(); ++v)
      if (result.places[v].corner != kNone)
        corners += std::count(input.vertices.begin(), input.vertices.end(), result.mesh.vertices[v]);
    EXPECT_GE(corners, 16u);
    EXPECT_LT(result.features.distance.vertices, 1e-10);
    if (!keeps) continue;
    for (const Index kept : options.keep_vertices) {
      const auto at = std::find(result.kept.begin(), result.kept.end(), kept);
      ASSERT_NE(at, result.kept.end());
      EXPECT_EQ(result.mesh.vertices[static_cast<std::size_t>(at - result.kept.begin())], input.vertices[kept]);
    }
  }
}

// Distances are measured, and edges become shorter, where the input is.
TEST(SetApart, ComesNearTheInput) {
  const TriangleMesh input = joined(icosphere(3), icosphere(3), {0.7, 0, 0});
  RemeshOptions options;
  options.vertices = 120;
  options.distance_max = 0.03;
  const RemeshResult result = remesh(input, options);
  EXPECT_LE(result.distance.upper, 0.03);
  EXPECT_GT(result.distance.runs, 0);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_LE(bound_hausdorff_distance(result.mesh, input, 1e-4, {}).lower, result.distance.upper);
}

// Measured on what is set apart, whose box is larger.
TEST(SetApart, ReportsDistancesInPercentOfTheInputsDiagonal) {
  const TriangleMesh input = joined(icosphere(4), icosphere(4), {2.05, 0, 0});
  RemeshOptions options;
  options.vertices = 300;
  options.fit = true;
  const RemeshResult result = remesh(input, options);
  const double reported = result.fitted.after.to_reference,
               measured = measure_distance(result.mesh, input).rms_to_reference;
  EXPECT_GT(reported, 0.8 * measured);
  EXPECT_LT(reported, 1.1 * measured);
}

}  // namespace
}  // namespace bisector::test
