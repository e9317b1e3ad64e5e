// What is kept of the input: vertices, edges and triangles, bit for bit, and a sound mesh around them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "remesh/kept.h"
#include "remesh/whole_edges.h"
#include "support/diagram.h"
#include "support/models.h"

namespace bisector::test {
namespace {

using Corners = std::array<std::array<double, 3>, 3>;

Corners corners_of(const TriangleMesh& mesh, std::size_t t) {
  Corners corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& p = mesh.vertices[mesh.triangles[t][k]];
    corners[k] = {p.x, p.y, p.z};
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

// The triangles whose centroids are nearest to a point.
std::vector<Index> patch(const TriangleMesh& mesh, const Vec3& middle, std::size_t count) {
  std::vector<std::pair<double, Index>> order;
  for (Index t = 0; t < mesh.triangles.size(); ++t) {
    Vec3 centroid{};
    for (const Index v : mesh.triangles[t]) centroid += (1.0 / 3) * mesh.vertices[v];
    order.push_back({norm2(centroid - middle), t});
  }
  std::sort(order.begin(), order.end());
  std::vector<Index> found;
  for (std::size_t k = 0; k < count; ++k) found.push_back(order[k].second);
  std::sort(found.begin(), found.end());
  return found;
}

void expect_kept(const TriangleMesh& input, const std::vector<Index>& triangles, const RemeshResult& result) {
  std::vector<Corners> got;
  for (std::size_t t = 0; t < result.mesh.triangles.size(); ++t) got.push_back(corners_of(result.mesh, t));
  std::sort(got.begin(), got.end());
  for (const Index t : triangles)
    EXPECT_EQ(std::count(got.begin(), got.end(), corners_of(input, t)), 1) << "triangle " << t;
  ASSERT_EQ(result.kept.size(), result.mesh.vertices.size());
  for (std::size_t v = 0; v < result.kept.size(); ++v) {
    if (result.kept[v] == kNone) continue;
    EXPECT_EQ(result.mesh.vertices[v], input.vertices[result.kept[v]]);
  }
}

void expect_sound(const TriangleMesh& input, const RemeshResult& result) {
  const MeshTopology want = analyse_topology(input.triangles, input.vertices.size());
  const MeshTopology got = analyse_topology(result.mesh.triangles, result.mesh.vertices.size());
  EXPECT_TRUE(got.manifold);
  EXPECT_TRUE(got.oriented);
  EXPECT_EQ(got.closed, want.closed);
  EXPECT_EQ(got.euler, want.euler);
  EXPECT_EQ(got.boundary_edges == 0, want.boundary_edges == 0);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(count_self_intersections(result.mesh), 0u);
}

struct Case {
  std::string name;
  TriangleMesh mesh;
  Vec3 middle;
  std::size_t triangles, vertices;
  double min_angle;
};

void PrintTo(const Case& problem, std::ostream* out) { *out << problem.name; }

class KeptFaces : public testing::TestWithParam<Case> {};

// On surfaces whose triangles are about as large as the result's, smaller, and many times larger.
TEST_P(KeptFaces, AreThoseOfTheInputAndTheRestIsSound) {
  const auto& [name, mesh, middle, triangles, vertices, min_angle] = GetParam();
  RemeshOptions options;
  options.vertices = vertices;
  options.keep_triangles = patch(mesh, middle, triangles);
  const RemeshResult result = remesh(mesh, options);
  expect_kept(mesh, options.keep_triangles, result);
  expect_sound(mesh, result);
  EXPECT_EQ(result.kept_triangles, triangles);
  TriangleMesh made = result.mesh;
  made.triangles.resize(made.triangles.size() - result.kept_triangles);
  EXPECT_GT(measure_quality(made).theta_min, min_angle);
  EXPECT_NEAR(measure_quality(result.mesh).area, measure_quality(mesh).area, 0.02 * measure_quality(mesh).area);
}

INSTANTIATE_TEST_SUITE_P(Surfaces, KeptFaces,
                         testing::Values(Case{"icosphere_alike", icosphere(3), {0, 0, 1}, 60, 600, 25},
                                         Case{"icosphere_finer", icosphere(4), {1, 0, 0}, 250, 500, 15},
                                         Case{"icosphere_coarser", icosphere(2), {0, 1, 0}, 16, 1500, 12},
                                         Case{"box", box(8), {1, 1, 1}, 40, 900, 15},
                                         Case{"patch_with_border", wavy_patch(24), {0, 0, 0}, 60, 500, 15}),
                         [](const auto& problem) { return problem.param.name; });

TEST(Kept, VerticesStayAndEdgesAreNotDivided) {
  const TriangleMesh mesh = icosphere(3);
  RemeshOptions options;
  options.vertices = 900;
  options.keep_vertices = {3, 77, 200};
  const Triangle& t = mesh.triangles[500];
  options.keep_edges = {{t[0], t[1]}};
  const RemeshResult result = remesh(mesh, options);
  expect_sound(mesh, result);
  std::set<Index> kept(result.kept.begin(), result.kept.end());
  kept.erase(kNone);
  EXPECT_EQ(kept, (std::set<Index>{3, 77, 200, t[0], t[1]}));
  expect_kept(mesh, {}, result);
  const auto is_edge = [&](const Triangle& corners) {
    int ends = 0;
    for (const Index v : corners) ends += result.kept[v] == t[0] || result.kept[v] == t[1];
    return ends == 2;
  };
  EXPECT_EQ(std::count_if(result.mesh.triangles.begin(), result.mesh.triangles.end(), is_edge), 2);
  EXPECT_GT(measure_quality(result.mesh).theta_min, 20);
}

TEST(Kept, DoesNotDependOnTheOrderOfTheInput) {
  const TriangleMesh mesh = icosphere(3);
  RemeshOptions options;
  options.vertices = 400;
  options.keep_triangles = patch(mesh, {0, 0, 1}, 40);
  const RemeshResult result = remesh(mesh, options);
  options.threads = 1;
  const RemeshResult again = remesh(mesh, options);
  EXPECT_EQ(result.mesh.triangles, again.mesh.triangles);
  EXPECT_TRUE(same_bits(result.mesh.vertices, again.mesh.vertices));
}

TEST(Kept, IsRefusedWhereItCannotBe) {
  const TriangleMesh mesh = icosphere(2);
  RemeshOptions options;
  options.vertices = 100;
  const auto refused = [&](const RemeshOptions& asked, const char* word) {
    try {
      remesh(mesh, asked);
      ADD_FAILURE() << "taken: " << word;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  RemeshOptions asked = options;
  asked.keep_vertices = {static_cast<Index>(mesh.vertices.size())};
  refused(asked, "none of the mesh's");
  asked = options;
  asked.keep_edges = {{0, 0}};
  refused(asked, "not an edge");
  asked = options;
  asked.keep_triangles = {static_cast<Index>(mesh.triangles.size())};
  refused(asked, "none of the mesh's");
  for (Index t = 0; t < mesh.triangles.size(); ++t) asked.keep_triangles.push_back(t);
  asked.keep_triangles.erase(asked.keep_triangles.begin());
  refused(asked, "nothing is left");
  asked.keep_triangles.pop_back();
  refused(asked, "ask for more than");
  asked = options;
  asked.keep_triangles = {0};
  asked.seeds.assign(10, mesh.vertices[0]);
  asked.vertices = 0;
  refused(asked, "seeds");
}

TEST(AddCorners, DividesCurvesWhereTheyPass) {
  FeatureGraph graph;
  graph.corners = {0, 4};
  graph.curves = {{{0, 1, 2, 3, 4}, false, FeatureKind::crease}, {{5, 6, 7}, true, FeatureKind::border}};
  add_corners(graph, {2, 6, 9, 0});
  EXPECT_EQ(graph.corners, (std::vector<Index>{0, 2, 4, 6, 9}));
  ASSERT_EQ(graph.curves.size(), 3u);
  EXPECT_EQ(graph.curves[0].vertices, (std::vector<Index>{0, 1, 2}));
  EXPECT_EQ(graph.curves[1].vertices, (std::vector<Index>{2, 3, 4}));
  EXPECT_EQ(graph.curves[2].vertices, (std::vector<Index>{6, 7, 5, 6}));
  EXPECT_FALSE(graph.curves[2].closed);
}

// A square in a fan around a vertex on its lower edge: without it the edge is whole, and the area is what it was.
TEST(MakeWhole, TakesVerticesOutOfAnEdge) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0.2, 0, 0}, {0.6, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0.5, 1.6, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 6}, {1, 5, 6}, {1, 2, 5}, {2, 4, 5}, {2, 3, 4}};
  WholeEdgesOptions options;
  options.movable.assign(7, 0);
  options.project = [](const Vec3& p) { return p; };
  make_whole(mesh, {{0, 1, 2, 3}}, options);
  EXPECT_EQ(mesh.triangles.size(), 3u);
  double area = 0;
  std::set<Index> used;
  for (const Triangle& t : mesh.triangles) {
    area += triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
    used.insert(t.begin(), t.end());
  }
  EXPECT_NEAR(area, 1.3, 1e-12);
  EXPECT_EQ(used, (std::set<Index>{0, 3, 4, 5, 6}));
}

// A vertex close to an edge that stays, alone or with another beside it.
TEST(MakeWhole, MendsSliversBesideAnEdge) {
  for (const bool two : {false, true}) {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.05, 0}};
    mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    if (two) {
      mesh.vertices.push_back({0.55, 0.1, 0});
      mesh.triangles = {{0, 1, 4}, {1, 5, 4}, {1, 2, 5}, {2, 3, 5}, {3, 4, 5}, {3, 0, 4}};
    }
    WholeEdgesOptions options;
    options.movable = {0, 0, 0, 0, 1, 1};
    options.project = [](const Vec3& p) { return p; };
    make_whole(mesh, {{0, 1}}, options);
    double area = 0;
    bool has_edge = false;
    for (const Triangle& t : mesh.triangles) {
      area += triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
      has_edge = has_edge || (std::count(t.begin(), t.end(), Index{0}) && std::count(t.begin(), t.end(), Index{1}));
    }
    EXPECT_NEAR(area, 1, 1e-12);
    EXPECT_TRUE(has_edge);
    EXPECT_GT(measure_quality(mesh).theta_min, 30);
  }
}

}  // namespace
}  // namespace bisector::test
