// The budget for detail: what is resolved grows with the number of vertices, and what is resolved has good triangles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "remesh/detail.h"
#include "remesh/sizing.h"
#include "support/featured.h"
#include "support/models.h"

namespace bisector::test {
namespace {

// A box of 4 by 3 by 1, one of whose edges of length 1 is cut off by a chamfer of the given width.
TriangleMesh chamfered(double width) {
  const double cut = width / std::sqrt(2);
  return prism({{0, 0}, {4, 0}, {4, 3 - cut}, {4 - cut, 3}, {0, 3}});
}

DetailPlan plan_for(const TriangleMesh& mesh, std::size_t vertices) {
  SizingTarget target;
  target.vertices = vertices;
  const double h = compute_sizing(mesh, {}, target).unit_edge;
  return plan_details(mesh, sharp_graph(mesh), std::vector<double>(mesh.vertices.size(), h), vertices, false);
}

TEST(Detail, WhereNothingIsFineEdgesAreAsTheyWere) {
  for (const FeaturedModel& model : featured_models()) {
    if (model.name != std::string("box") && model.name != std::string("cylinder")) continue;
    const DetailPlan plan = plan_for(model.mesh, 2000);
    EXPECT_EQ(plan.features.edges, sharp_graph(model.mesh).edges) << model.name;
    EXPECT_TRUE(plan.lengths.empty()) << model.name;
  }
}

TEST(Detail, MoreVerticesResolveMore) {
  const TriangleMesh mesh = chamfered(0.05);
  double width = 1e9;
  std::size_t curves = 0;
  for (const std::size_t vertices : {100, 400, 2000, 20000}) {
    const DetailPlan plan = plan_for(mesh, vertices);
    EXPECT_LE(plan.result.width, width);
    EXPECT_GE(plan.features.curves.size(), curves);
    width = plan.result.width;
    curves = plan.features.curves.size();
  }
  EXPECT_EQ(curves, sharp_graph(mesh).curves.size());
}

// Each triangle is divided into needles from one edge to the corner opposite, which leaves all edges as they are.
TriangleMesh in_needles(const TriangleMesh& mesh, int layers) {
  TriangleMesh needles;
  needles.vertices = mesh.vertices;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 middle = 0.5 * (mesh.vertices[a] + mesh.vertices[b]);
    Index last = kNone;
    for (int k = 1; k < layers; ++k) {
      const auto next = static_cast<Index>(needles.vertices.size());
      needles.vertices.push_back(middle + (static_cast<double>(k) / layers) * (mesh.vertices[c] - middle));
      if (last == kNone) needles.triangles.push_back({a, b, next});
      else needles.triangles.insert(needles.triangles.end(), {{a, last, next}, {last, b, next}});
      last = next;
    }
    needles.triangles.insert(needles.triangles.end(), {{a, last, c}, {last, b, c}});
  }
  return needles;
}

TEST(Detail, TakesAsManyVerticesInNeedles) {
  const TriangleMesh mesh = chamfered(0.05);
  const DetailPlan plain = plan_for(mesh, 400), needles = plan_for(in_needles(mesh, 400), 400);
  ASSERT_FALSE(plain.points.empty());
  EXPECT_NEAR(static_cast<double>(needles.result.vertices), static_cast<double>(plain.result.vertices),
              0.03 * static_cast<double>(plain.result.vertices));
}

TEST(Detail, LengthsAreThoseOfTheGaps) {
  const double width = 0.2;
  const TriangleMesh mesh = chamfered(width);
  const DetailPlan plan = plan_for(mesh, 500);
  ASSERT_FALSE(plan.points.empty());
  for (const double length : plan.lengths) EXPECT_GE(length, 0.9 * width);
  EXPECT_NEAR(*std::min_element(plan.lengths.begin(), plan.lengths.end()), width, 1e-9);
}

// Borders stay however near to each other they are, so shorter edges between them are no use.
TEST(Detail, NarrowRibbonsKeepTheirEdgeLength) {
  for (const double width : {0.002, 0.2}) {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {4, 0, 0}, {4, width, 0}, {0, width, 0}, {0, 0, 1}, {4, 0, 1}, {4, 2, 1}, {0, 2, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
    const DetailPlan plan = plan_for(mesh, 400);
    const bool bounded = std::any_of(plan.points.begin(), plan.points.end(),
                                     [](const Vec3& p) { return p.z == 0 && p.x > 1 && p.x < 3; });
    EXPECT_EQ(bounded, width == 0.2) << width;
  }
}

// Separate triangles, whose corners alone are more than half of the vertices wanted.
TEST(Detail, OfASoupIsNotPlanned) {
  TriangleMesh soup;
  for (Index k = 0; k < 100; ++k) {
    const double x = k % 10, y = 0.001 * k;
    soup.vertices.insert(soup.vertices.end(), {{x, y, 0}, {x + 0.9, y, 0}, {x, y, 1}});
    soup.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
  }
  FeatureGraph borders = sharp_graph(soup);
  for (FeatureCurve& curve : borders.curves) curve.kind = FeatureKind::border;
  ASSERT_EQ(borders.corners.size(), 300u);
  const std::vector<double> lengths(soup.vertices.size(), 0.9);
  const DetailPlan few = plan_details(soup, borders, lengths, 400, false);
  EXPECT_EQ(few.features.edges, borders.edges);
  EXPECT_TRUE(few.points.empty());
  EXPECT_FALSE(plan_details(soup, borders, lengths, 4000, false).points.empty());
}

// A slab thinner than its edges: one row of slivers around it without the budget.
TEST(Detail, ThinWallsHaveGoodTriangles) {
  const TriangleMesh slab = prism({{0, 0}, {2, 0}, {2, 0.1}, {0, 0.1}});
  RemeshOptions options;
  options.compute.device = DeviceRequest{.kind = DeviceRequest::Kind::cpu};
  for (const std::size_t vertices : {400, 1500}) {
    options.vertices = vertices;
    const RemeshResult result = remesh(slab, options);
    const QualityReport quality = measure_quality(result.mesh);
    EXPECT_TRUE(result.topology_matches);
    EXPECT_EQ(result.features.broken, 0u);
    EXPECT_EQ(result.mesh.vertices.size(), vertices);
    EXPECT_GT(quality.theta_min, 25);
  }
}

// A thinner slab with a fin on one of its edges, where three sheets meet.
TEST(Detail, ThinWallsHaveGoodTrianglesWhereSheetsMeet) {
  TriangleMesh slab = prism({{0, 0}, {2, 0}, {2, 0.02}, {0, 0.02}});
  const auto at = [&](const Vec3& p) {
    const auto found = std::find(slab.vertices.begin(), slab.vertices.end(), p);
    EXPECT_NE(found, slab.vertices.end());
    return static_cast<Index>(found - slab.vertices.begin());
  };
  const Index low = at({0, 0, 0}), high = at({0, 0, 1}), far = static_cast<Index>(slab.vertices.size());
  slab.vertices.insert(slab.vertices.end(), {{-1, 0, 0}, {-1, 0, 1}});
  slab.triangles.insert(slab.triangles.end(), {{low, far, far + 1}, {low, far + 1, high}});
  ASSERT_EQ(topology_of(slab).non_manifold_edges, 1u);
  RemeshOptions options;
  options.compute.device = DeviceRequest{.kind = DeviceRequest::Kind::cpu};
  options.vertices = 400;
  const RemeshResult result = remesh(slab, options);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_EQ(result.mesh.vertices.size(), 400u);
  EXPECT_GT(measure_quality(result.mesh).theta_min, 25);
}

// A hole stays, however small, so edges grow from its length.
TEST(Detail, SmallHolesHaveEdgesAsShortAsThey) {
  TriangleMesh ball = icosphere(3);
  const Triangle around = ball.triangles.back();
  ball.triangles.pop_back();
  const auto [a, b, c] = around;
  const Vec3 centre = (1.0 / 3) * (ball.vertices[a] + ball.vertices[b] + ball.vertices[c]);
  const auto hole = static_cast<Index>(ball.vertices.size());
  for (const Index v : around) ball.vertices.push_back(centre + 0.002 * (ball.vertices[v] - centre));
  for (Index k = 0; k < 3; ++k) {
    const Index next = (k + 1) % 3;
    ball.triangles.push_back({around[k], around[next], hole + next});
    ball.triangles.push_back({around[k], hole + next, hole + k});
  }
  FeatureGraph border = sharp_graph(ball);
  ASSERT_EQ(border.curves.size(), 3u);
  for (FeatureCurve& curve : border.curves) curve.kind = FeatureKind::border;
  const double side = norm(ball.vertices[hole + 1] - ball.vertices[hole]);
  const std::vector<double> lengths(ball.vertices.size(), 0.1);
  const DetailPlan plan = plan_details(ball, border, lengths, 1000, false);
  ASSERT_FALSE(plan.lengths.empty());
  const double finest = *std::min_element(plan.lengths.begin(), plan.lengths.end());
  EXPECT_GE(finest, 0.5 * side);
  EXPECT_LE(finest, 1.01 * side);
  // Not where the vertices are too few for the edges around it.
  for (const double length : plan_details(ball, border, lengths, 400, false).lengths) EXPECT_GT(length, 2 * side);
}

TEST(Detail, IsTheSameWithAnyNumberOfThreads) {
  const TriangleMesh mesh = chamfered(0.05);
  const DetailPlan all = plan_for(mesh, 600);
  const ThreadLimit limit(1);
  const DetailPlan one = plan_for(mesh, 600);
  EXPECT_EQ(all.features.edges, one.features.edges);
  EXPECT_EQ(all.lengths, one.lengths);
  EXPECT_EQ(all.result.width, one.result.width);
}

}  // namespace
}  // namespace bisector::test
