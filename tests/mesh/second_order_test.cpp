// Nodes on edges: near the surface, and no element turned over anywhere.
#include "bisector/second_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bisector/features.h"
#include "core/geometry.h"
#include "mesh/tet_topology.h"
#include "spatial/nearest.h"
#include "support/models.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

// The Jacobian's determinant at a point, by its definition: derivatives of the sum of shape functions (Hughes, The
// Finite Element Method, 1987, 3.I).
double determinant(const TetMesh& mesh, const SecondOrder& order, std::size_t tet, const std::array<double, 4>& l) {
  const Tetrahedron& v = mesh.tets[tet];
  std::array<Vec3, 3> along{};  // by coordinates 1 to 3, coordinate 0 being 1 less their sum
  const auto add = [&](const Vec3& node, const std::array<double, 4>& by) {
    for (std::size_t k = 0; k < 3; ++k) along[k] += (by[k + 1] - by[0]) * node;
  };
  for (std::size_t i = 0; i < 4; ++i) {
    std::array<double, 4> by{};
    by[i] = 4 * l[i] - 1;
    add(mesh.vertices[v[i]], by);
    for (std::size_t j = 0; j < i; ++j) {
      by = {};
      by[i] = 4 * l[j];
      by[j] = 4 * l[i];
      add(order.nodes[order.node_of(v[i], v[j])], by);
    }
  }
  return dot(along[0], cross(along[1], along[2]));
}

// A ball: the cube's grid with its vertices moved towards spheres.
TetMesh ball(int n) {
  TetMesh mesh = tet_box(n);
  for (Vec3& p : mesh.vertices) {
    const Vec3 q = 2.0 * p - Vec3{1, 1, 1};
    const double most = std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z)});
    p = most == 0 ? q : (most / norm(q)) * q;
  }
  return mesh;
}

void expect_positive(const TetMesh& mesh, const SecondOrder& order) {
  SplitMix64 random(1);
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const JacobianBound bound = jacobian_bound(mesh, order, t);
    if (bound.straight > 0) {
      EXPECT_GT(bound.least, 0);
    }
    for (int k = 0; k < 30; ++k) {
      std::array<double, 4> l{random.unit(), random.unit(), random.unit(), random.unit()};
      if (k < 4) l = {};
      if (k < 4) l[static_cast<std::size_t>(k)] = 1;
      const double sum = l[0] + l[1] + l[2] + l[3];
      for (double& x : l) x /= sum;
      EXPECT_GE(determinant(mesh, order, t, l), bound.least - 1e-12);
    }
  }
}

TEST(SecondOrder, StraightEdgesWhereTheSurfaceIsFlat) {
  const TetMesh mesh = shaken(tet_box(3), 0, 1);
  const TriangleMesh surface = box(8);
  SecondOrderReport report;
  const SecondOrder order = second_order(mesh, surface, detect_features(surface).edges, &report);
  EXPECT_EQ(report.curved, 0u);
  EXPECT_EQ(report.held_back, 0u);
  EXPECT_NEAR(report.jacobian_min, 1, 1e-12);
  for (std::size_t e = 0; e < order.edges.size(); ++e)
    EXPECT_EQ(order.nodes[e], 0.5 * (mesh.vertices[order.edges[e][0]] + mesh.vertices[order.edges[e][1]]));
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const JacobianBound bound = jacobian_bound(mesh, order, t);
    EXPECT_NEAR(bound.least, bound.straight, 1e-12);
  }
  EXPECT_TRUE(std::is_sorted(order.edges.begin(), order.edges.end()));
  EXPECT_EQ(order.node_of(order.edges[3][1], order.edges[3][0]), 3u);
  EXPECT_EQ(order.node_of(0, 0), kNone);
}

TEST(SecondOrder, ABallsNodesAreOnTheSphere) {
  const TriangleMesh sphere = icosphere(6);
  for (const int n : {4, 6, 8}) {
    const TetMesh mesh = ball(n);
    SecondOrderReport report;
    const SecondOrder order = second_order(mesh, sphere, {}, &report);
    expect_positive(mesh, order);
    EXPECT_GT(report.jacobian_min, 0);
    EXPECT_GT(report.curved, 0u);
    EXPECT_EQ(report.boundary_nodes, 3 * boundary_facets(mesh.tets).size() / 2);
    EXPECT_LT(report.node_distance_mean, 0.25 * report.middle_distance_mean) << n;
    if (report.held_back == 0) {
      EXPECT_LT(report.node_distance_max, 1e-3 * report.middle_distance_max);
    }
  }
}

TEST(SecondOrder, NodesOfFeatureEdgesAreOnTheCurves) {
  // A quarter more vertices along a circle than the coarse solid has.
  TriangleMesh drum;
  constexpr int kFine = 96;
  const auto at = [](double turn, double z) { return Vec3{std::cos(2 * M_PI * turn), std::sin(2 * M_PI * turn), z}; };
  for (int i = 0; i < kFine; ++i)
    for (const double z : {0.0, 1.0}) drum.vertices.push_back(at(i / static_cast<double>(kFine), z));
  drum.vertices.push_back({0, 0, 0});
  drum.vertices.push_back({0, 0, 1});
  std::vector<std::array<Index, 2>> rims;
  for (Index i = 0; i < kFine; ++i) {
    const Index j = (i + 1) % kFine;
    drum.triangles.insert(drum.triangles.end(), {{2 * i, 2 * j, 2 * i + 1},
                                                 {2 * j, 2 * j + 1, 2 * i + 1},
                                                 {2 * j, 2 * i, 2 * kFine},
                                                 {2 * i + 1, 2 * j + 1, 2 * kFine + 1}});
    rims.push_back({std::min(2 * i, 2 * j), std::max(2 * i, 2 * j)});
    rims.push_back({std::min(2 * i, 2 * j) + 1, std::max(2 * i, 2 * j) + 1});
  }
  TetMesh mesh;  // a fan of prisms of three tetrahedra about the axis
  constexpr int kCoarse = 12;
  for (int i = 0; i < kCoarse; ++i)
    for (const double z : {0.0, 1.0}) mesh.vertices.push_back(at(i / static_cast<double>(kCoarse), z));
  mesh.vertices.push_back({0, 0, 0});
  mesh.vertices.push_back({0, 0, 1});
  const Index below = 2 * kCoarse, above = below + 1;
  for (Index i = 0; i < kCoarse; ++i) {
    const Index j = (i + 1) % kCoarse;
    mesh.tets.insert(
        mesh.tets.end(),
        {{below, 2 * i, 2 * j, above}, {2 * i, 2 * j, above, 2 * i + 1}, {2 * j, 2 * j + 1, above, 2 * i + 1}});
    mesh.feature_edges.push_back({std::min(2 * i, 2 * j), std::max(2 * i, 2 * j)});
    mesh.feature_edges.push_back({std::min(2 * i, 2 * j) + 1, std::max(2 * i, 2 * j) + 1});
  }
  for (Tetrahedron& t : mesh.tets)
    if (rounded_six_volume(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], mesh.vertices[t[3]]) < 0)
      std::swap(t[2], t[3]);
  std::sort(mesh.feature_edges.begin(), mesh.feature_edges.end());
  SecondOrderReport report;
  const SecondOrder order = second_order(mesh, drum, rims, &report);
  expect_positive(mesh, order);
  for (const auto& [a, b] : mesh.feature_edges) {
    const Vec3 node = order.nodes[order.node_of(a, b)];
    EXPECT_EQ(node.z, mesh.vertices[a].z);  // neither up nor down the wall
    EXPECT_NEAR(std::hypot(node.x, node.y), 1, 6e-4);
  }
}

// Thin elements beside a strong bend: nodes go back, and none turns over.
TEST(SecondOrder, NodesAreHeldBackBeforeElementsTurnOver) {
  TetMesh mesh = tet_grid(4, 4, 1);
  for (Vec3& p : mesh.vertices) p.z *= 0.02;
  TriangleMesh dented =
      grid_patch(32, 32);  // under the lower side, with bumps up through the upper one between vertices
  for (Vec3& p : dented.vertices) {
    p = 0.125 * p;
    p.z = 0.2 * std::pow(std::sin(M_PI * p.x) * std::sin(M_PI * p.y), 2);
  }
  SecondOrderReport report;
  const SecondOrder order = second_order(mesh, dented, {}, &report);
  EXPECT_GT(report.held_back, 0u);
  EXPECT_GT(report.jacobian_min, 0);
  expect_positive(mesh, order);
}

}  // namespace
}  // namespace bisector::test
