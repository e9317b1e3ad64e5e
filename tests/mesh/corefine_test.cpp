// Components are cut where they cross: the surface stays, and they meet in common vertices and edges alone.
#include "mesh/corefine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "bisector/quality.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "mesh/topology.h"
#include "mesh/touching.h"
#include "support/figure_of_eight.h"
#include "support/models.h"

namespace bisector::test {
namespace {

constexpr std::size_t kAnyPairs = 100'000;

double area_of(const TriangleMesh& mesh, std::int32_t label) {
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    if (mesh.labels[t] == label) area += triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
  }
  return area;
}

// A label for each component.
TriangleMesh labelled(TriangleMesh mesh) {
  const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  for (const Triangle& t : mesh.triangles) mesh.labels.push_back(static_cast<std::int32_t>(component[t[0]]));
  return mesh;
}

struct Crossing {
  std::string name;
  TriangleMesh mesh;
  std::size_t loops;
  bool exact;  // all points of intersection are doubles
};

void PrintTo(const Crossing& crossing, std::ostream* out) { *out << crossing.name; }

std::vector<Crossing> crossings() {
  TriangleMesh rod = box(1);
  for (Vec3& p : rod.vertices) p = {4 * p.x - 1.5, 0.5 * p.y + 0.25, 0.5 * p.z + 0.25};
  return {{"rod_through_a_box", labelled(joined(box(1), rod)), 2, true},
          {"boxes_at_a_corner", labelled(joined(box(2), box(2), {0.625, 0.75, 0.375})), 1, true},
          {"spheres", labelled(joined(icosphere(3), icosphere(3), {0.7, 0.2, 0.1})), 1, false},
          {"torus_and_sphere", labelled(joined(torus(30, 20), icosphere(3), {0.3, 0.1, 0.2})), 2, false}};
}

class Corefined : public testing::TestWithParam<Crossing> {};

TEST_P(Corefined, IsTheSameSurfaceAndMeetsInEdges) {
  const TriangleMesh& input = GetParam().mesh;
  const std::size_t before = input.vertices.size();
  ASSERT_GT(count_self_intersections(input), 0u);
  const auto cut = corefine_components(input, kAnyPairs);
  ASSERT_TRUE(cut.has_value());
  const MeshTopology now = analyse_topology(cut->mesh.triangles, cut->mesh.vertices.size());
  const MeshTopology then = analyse_topology(input.triangles, before);
  EXPECT_TRUE(now.manifold && now.oriented);
  EXPECT_EQ(now.boundary_edges, 0u);
  EXPECT_EQ(now.euler, then.euler);
  EXPECT_EQ(now.components, then.components);
  for (const std::int32_t label : {0, 1})
    EXPECT_NEAR(area_of(cut->mesh, label), area_of(input, label), 1e-12 * area_of(input, label));
  if (GetParam().exact) EXPECT_EQ(count_self_intersections(cut->mesh), 0u);
  else EXPECT_LT(count_self_intersections(cut->mesh), count_self_intersections(input) / 10);

  // Vertices are where it is said that they were put in.
  ASSERT_EQ(cut->inserted.size(), cut->mesh.vertices.size() - before);
  for (std::size_t k = 0; k < cut->inserted.size(); ++k) {
    const auto& [triangle, weights] = cut->inserted[k];
    Vec3 p;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_GE(weights[i], -1e-9);
      p += weights[i] * input.vertices[input.triangles[triangle][i]];
    }
    EXPECT_LT(norm(p - cut->mesh.vertices[before + k]), 1e-12);
  }
  for (const auto& [a, b, middle] : cut->splits) {
    const Vec3 &p = cut->mesh.vertices[a], &q = cut->mesh.vertices[b], &m = cut->mesh.vertices[middle];
    EXPECT_NEAR(norm(m - p) + norm(q - m), norm(q - p), 1e-12);
  }

  // Lines in which closed surfaces cross are closed.
  const CommonParts common = find_common_parts(cut->mesh);
  std::map<Index, std::vector<Index>> next;
  for (const auto& [a, b] : common.edges) {
    next[a].push_back(b);
    next[b].push_back(a);
  }
  for (const auto& [point, others] : next) EXPECT_EQ(others.size(), 2u);
  std::size_t loops = 0;
  std::map<Index, char> seen;
  for (const auto& [start, others] : next) {
    if (seen[start]) continue;
    ++loops;
    for (std::vector<Index> ahead{start}; !ahead.empty();) {
      const Index v = ahead.back();
      ahead.pop_back();
      if (seen[v]++) continue;
      for (const Index w : next[v]) ahead.push_back(w);
    }
  }
  EXPECT_EQ(loops, GetParam().loops);
}

INSTANTIATE_TEST_SUITE_P(All, Corefined, testing::ValuesIn(crossings()), [](const auto& p) { return p.param.name; });

TEST(Corefine, CutsNothingWhereAreasAreCommonOrNothingMeets) {
  const auto stacked = corefine_components(joined(box(1), box(2), {0.5, 0.5, 1}), kAnyPairs);
  ASSERT_TRUE(stacked.has_value());
  EXPECT_TRUE(stacked->inserted.empty());
  EXPECT_EQ(stacked->overlapping, (std::vector<std::array<Index, 2>>{{0, 1}}));
  EXPECT_FALSE(corefine_components(joined(box(1), box(1), {2, 0, 0}), kAnyPairs).has_value());
  // One surface that crosses itself has one component.
  EXPECT_FALSE(corefine_components(box(2), kAnyPairs).has_value());
  EXPECT_FALSE(corefine_components(joined(box(2), box(2), {0.625, 0.75, 0.375}), 1).has_value());
}

// A figure of eight around an axis: a torus that goes through itself along a circle, the two halves of which bound
// volumes of opposite signs. With an open one some triangles are missing.
class Eight : public testing::TestWithParam<bool> {
 protected:
  static TriangleMesh input() {
    TriangleMesh mesh = figure_of_eight(24, 17);
    if (GetParam()) mesh.triangles.resize(mesh.triangles.size() - 4);
    return mesh;
  }
};

TEST_P(Eight, IsCutIntoTwoThatTouch) {
  const TriangleMesh mesh = input();
  const std::size_t pairs = count_self_intersections(mesh);
  ASSERT_GT(pairs, 20u);
  EXPECT_FALSE(corefine_components(mesh, kAnyPairs).has_value());
  EXPECT_FALSE(corefine_sheets(mesh, 1).has_value());
  const auto cut = corefine_sheets(mesh, kAnyPairs);
  ASSERT_TRUE(cut.has_value());
  TriangleMesh parts = cut->mesh;
  EXPECT_LT(count_self_intersections(parts), pairs / 10);
  const auto whole_area = [](const TriangleMesh& m) {
    double area = 0;
    for (const auto& [a, b, c] : m.triangles) area += triangle_area(m.vertices[a], m.vertices[b], m.vertices[c]);
    return area;
  };
  EXPECT_NEAR(whole_area(parts), whole_area(mesh), 1e-12 * whole_area(mesh));

  // Edges of four triangles are those of one circle.
  const EdgeTable table = edge_table(parts.triangles, parts.vertices.size());
  std::map<Index, int> on_circle;
  std::size_t edges = 0;
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    if (table.half_edges.size(e) <= 2) continue;
    EXPECT_EQ(table.half_edges.size(e), 4u);
    ++edges;
    for (const Index v : table.edges[e]) ++on_circle[v];
  }
  EXPECT_EQ(edges, on_circle.size());
  for (const auto& [v, count] : on_circle) {
    EXPECT_EQ(count, 2);
    EXPECT_NEAR(std::hypot(parts.vertices[v].x, parts.vertices[v].y), 3, 0.1);
    EXPECT_NEAR(parts.vertices[v].z, 0, 0.1);
  }

  const Touching touching = GetParam() ? Touching::sheets : Touching::solids;
  EXPECT_TRUE(halve_touching_edges(parts, touching).empty());
  separate_touching(parts, touching);
  const MeshTopology now = analyse_topology(parts.triangles, parts.vertices.size());
  EXPECT_TRUE(now.manifold && now.oriented);
  EXPECT_EQ(now.components, 2u);
  EXPECT_EQ(now.euler, analyse_topology(mesh.triangles, mesh.vertices.size()).euler);
  const std::vector<Index> component = label_components(parts.triangles, parts.vertices.size());
  std::map<Index, double> volumes;
  for (const auto& [a, b, c] : parts.triangles)
    volumes[component[a]] += rounded_six_volume({}, parts.vertices[a], parts.vertices[b], parts.vertices[c]) / 6;
  EXPECT_LT(volumes.begin()->second * volumes.rbegin()->second, 0);
}

INSTANTIATE_TEST_SUITE_P(All, Eight, testing::Bool(), [](const auto& p) { return p.param ? "open" : "closed"; });

TEST(Corefine, FindsNoEdgesInsideOfCommonFaces) {
  // The outline of the common face, but not the diagonals in it.
  const CommonParts common = find_common_parts(joined(box(2), box(2), {0, 0, 1}));
  EXPECT_EQ(common.edges.size(), 8u);
  EXPECT_TRUE(find_common_parts(joined(box(2), box(2))).edges.empty());
  EXPECT_TRUE(find_common_parts(joined(box(2), box(2), {0, 0, 1}), {{0, 1}}).edges.empty());
}

}  // namespace
}  // namespace bisector::test
