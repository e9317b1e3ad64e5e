// Quality figures, topology and self-intersections of shapes where they are known by theory.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "bisector/io.h"
#include "bisector/quality.h"
#include "bisector/repair.h"
#include "core/geometry.h"
#include "mesh/topology.h"
#include "support/models.h"

namespace bisector::test {
namespace {

TEST(Quality, OfAnIcosahedron) {
  const QualityReport report = measure_quality(icosphere(0));
  const double edge = 1 / std::sin(2 * std::numbers::pi / 5);  // of circumradius 1
  EXPECT_NEAR(report.q_min, 1, 1e-12);
  EXPECT_NEAR(report.q_ave, 1, 1e-12);
  EXPECT_NEAR(report.theta_min, 60, 1e-10);
  EXPECT_NEAR(report.theta_min_ave, 60, 1e-10);
  EXPECT_NEAR(report.theta_max, 60, 1e-10);
  EXPECT_EQ(report.theta_below_30, 0);
  EXPECT_EQ(report.valence6, 0);  // all have five
  EXPECT_NEAR(report.edge_min, edge, 1e-14);
  EXPECT_NEAR(report.edge_ave, edge, 1e-14);
  EXPECT_NEAR(report.edge_max, edge, 1e-14);
  EXPECT_NEAR(report.area, 5 * std::sqrt(3.0) * edge * edge, 1e-12);
  EXPECT_EQ(report.zero_area, 0u);
  EXPECT_EQ(report.topology.euler, 2);
}

TEST(Quality, OfOneRightTriangle) {
  const TriangleMesh mesh{{{0, 0, 0}, {3, 0, 0}, {0, 4, 0}}, {{0, 1, 2}}, {}};
  const QualityReport report = measure_quality(mesh);
  EXPECT_DOUBLE_EQ(report.q_min, 6 / std::sqrt(3.0) * 6 / (6 * 5));
  EXPECT_NEAR(report.theta_min, std::atan2(3, 4) * 180 / std::numbers::pi, 1e-12);
  EXPECT_NEAR(report.theta_max, 90, 1e-12);
  EXPECT_EQ(report.theta_below_30, 0);
  EXPECT_EQ(report.edge_min, 3);
  EXPECT_EQ(report.edge_ave, 4);
  EXPECT_EQ(report.edge_max, 5);
  EXPECT_EQ(report.area, 6);
}

TEST(Quality, DoesNotDependOnScale) {
  TriangleMesh mesh = wavy_patch(6);
  const QualityReport expected = measure_quality(mesh);
  for (const double scale : {0x1p-300, 0x1p300}) {
    TriangleMesh scaled = mesh;
    for (Vec3& v : scaled.vertices) v *= scale;
    const QualityReport report = measure_quality(scaled);
    EXPECT_DOUBLE_EQ(report.q_min, expected.q_min);
    EXPECT_DOUBLE_EQ(report.theta_max, expected.theta_max);
    EXPECT_DOUBLE_EQ(report.area, expected.area * scale * scale);
  }
}

TEST(Quality, KeepsZeroAreaTrianglesOutOfTheMeans) {
  const QualityReport report = measure_quality(collinear_among_good());
  EXPECT_EQ(report.zero_area, 2u);
  EXPECT_EQ(report.q_min, 0);
  EXPECT_EQ(report.theta_min, 0);
  EXPECT_EQ(report.theta_max, 180);
  EXPECT_GT(report.q_ave, 0.5);
  EXPECT_GT(report.theta_min_ave, 30);
  EXPECT_DOUBLE_EQ(report.theta_below_30, 40);
  TriangleMesh flat = collinear_among_good();
  flat.triangles = {flat.triangles[1]};
  EXPECT_EQ(measure_quality(flat).q_ave, 0);
  EXPECT_EQ(measure_quality(flat).zero_area, 1u);
}

TEST(Quality, CountsInteriorVerticesOfSixNeighbours) {
  EXPECT_EQ(measure_quality(torus(9, 7)).valence6, 1);
  EXPECT_EQ(measure_quality(grid_patch(5, 4)).valence6, 1);  // the border does not count
  EXPECT_DOUBLE_EQ(measure_quality(icosphere(2)).valence6, (162.0 - 12) / 162);
  EXPECT_EQ(measure_quality(single_triangle()).valence6, 0);
}

TEST(Quality, OfNothingIsZero) {
  const QualityReport report = measure_quality({});
  EXPECT_EQ(report.q_ave, 0);
  EXPECT_EQ(report.edge_min, 0);
  EXPECT_FALSE(report.topology.manifold);
}

TEST(Topology, OfSphereTorusDiskAndTwoParts) {
  const MeshTopology sphere = topology_of(icosphere(2));
  EXPECT_TRUE(sphere.manifold && sphere.closed && sphere.oriented);
  EXPECT_EQ(sphere.euler, 2);
  EXPECT_EQ(sphere.components, 1u);

  const MeshTopology ring = topology_of(torus(6, 5));
  EXPECT_TRUE(ring.manifold && ring.closed && ring.oriented);
  EXPECT_EQ(ring.euler, 0);

  const MeshTopology disk = topology_of(grid_patch(4, 3));
  EXPECT_TRUE(disk.manifold && disk.oriented);
  EXPECT_FALSE(disk.closed);
  EXPECT_EQ(disk.euler, 1);
  EXPECT_EQ(disk.boundary_edges, 14u);

  const MeshTopology parts = topology_of(joined(icosphere(1), torus(5, 4), {9, 0, 0}));
  EXPECT_TRUE(parts.manifold && parts.closed && parts.oriented);
  EXPECT_EQ(parts.euler, 2);
  EXPECT_EQ(parts.components, 2u);
}

TEST(Topology, FindsWhatIsNotManifold) {
  const MeshTopology sheets = topology_of(pages());
  EXPECT_FALSE(sheets.manifold);
  EXPECT_EQ(sheets.non_manifold_edges, 1u);
  EXPECT_EQ(sheets.non_manifold_vertices, 0u);
  EXPECT_EQ(sheets.euler, 1);  // contractible

  const TriangleMesh bow{{{0, 0, 0}, {1, 1, 0}, {1, -1, 0}, {-1, 1, 0}, {-1, -1, 0}}, {{0, 2, 1}, {0, 3, 4}}, {}};
  const MeshTopology tie = topology_of(bow);
  EXPECT_FALSE(tie.manifold);
  EXPECT_EQ(tie.non_manifold_edges, 0u);
  EXPECT_EQ(tie.non_manifold_vertices, 1u);
  EXPECT_EQ(tie.components, 1u);

  // Two spheres that touch in one vertex.
  TriangleMesh touching = joined(icosphere(0), icosphere(0), {5, 0, 0});
  for (Triangle& t : touching.triangles)
    for (Index& v : t)
      if (v == 12) v = 0;
  const MeshTopology touch = topology_of(touching);
  EXPECT_FALSE(touch.manifold);
  EXPECT_TRUE(touch.closed);
  EXPECT_EQ(touch.non_manifold_vertices, 1u);
  EXPECT_EQ(touch.euler, 3);
  EXPECT_EQ(touch.components, 1u);

  TriangleMesh repeated = single_triangle();
  repeated.triangles = {{0, 0, 1}};
  EXPECT_FALSE(topology_of(repeated).manifold);
}

TEST(Topology, FindsWhatIsNotOriented) {
  TriangleMesh mesh = icosphere(1);
  std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
  const MeshTopology flipped = topology_of(mesh);
  EXPECT_TRUE(flipped.manifold && flipped.closed);
  EXPECT_FALSE(flipped.oriented);

  // A Moebius strip is a manifold that no choice of directions orients.
  TriangleMesh strip;
  const int n = 7;
  for (int i = 0; i < n; ++i)
    for (const double side : {-0.3, 0.3}) {
      const double u = 2 * std::numbers::pi * i / n;
      const double r = 1 + side * std::cos(u / 2);
      strip.vertices.push_back({r * std::cos(u), r * std::sin(u), side * std::sin(u / 2)});
    }
  for (Index i = 0; i < n; ++i) {
    const bool last = i + 1 == n;
    const Index a = 2 * i, b = 2 * i + 1, c = last ? 1 : 2 * i + 2, d = last ? 0 : 2 * i + 3;
    strip.triangles.push_back({a, c, b});
    strip.triangles.push_back({b, c, d});
  }
  const MeshTopology moebius = topology_of(strip);
  EXPECT_TRUE(moebius.manifold);
  EXPECT_FALSE(moebius.oriented);
  EXPECT_FALSE(moebius.closed);
  EXPECT_EQ(moebius.euler, 0);
}

TEST(Topology, IgnoresUnusedVertices) {
  TriangleMesh mesh = icosphere(0);
  mesh.vertices.insert(mesh.vertices.end(), 5, Vec3{9, 9, 9});
  EXPECT_EQ(topology_of(mesh).euler, 2);
  EXPECT_EQ(topology_of(mesh).components, 1u);
}

TEST(Topology, EdgeTableHoldsEveryHalfEdgeOnce) {
  const TriangleMesh mesh = pages();
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  std::vector<int> seen(3 * mesh.triangles.size(), 0);
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    if (e > 0) {
      EXPECT_LT(table.edges[e - 1], table.edges[e]);
    }
    for (const std::size_t* h = table.half_edges.begin(e); h != table.half_edges.end(e); ++h) {
      ++seen[*h];
      const Triangle& t = mesh.triangles[*h / 3];
      const Index a = t[*h % 3], b = t[(*h + 1) % 3];
      EXPECT_EQ(table.edges[e], (std::array{std::min(a, b), std::max(a, b)}));
    }
  }
  EXPECT_EQ(table.half_edges.rows(), table.edges.size());
  EXPECT_EQ(seen, std::vector<int>(seen.size(), 1));
}

TEST(SelfIntersections, NoneInEmbeddedSurfaces) {
  for (const TriangleMesh& mesh : {icosphere(3), torus(24, 12), box(4), grid_patch(5, 5), wavy_patch(8), pages(),
                                   two_spheres(), collinear_among_good(), single_triangle(), TriangleMesh{}})
    EXPECT_EQ(count_self_intersections(mesh), 0u);
}

TEST(SelfIntersections, CountsPairs) {
  const auto count = [](const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
    return count_self_intersections({vertices, triangles, {}});
  };
  const std::vector<Vec3> base{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
  const auto with = [&](const std::vector<Vec3>& more) {
    std::vector<Vec3> all = base;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  // No vertex in common: piercing, touching from above in a point, just missing it, apart in the same plane.
  EXPECT_EQ(count(with({{1, 1, -1}, {1, 1, 1}, {9, 9, 1}}), {{0, 1, 2}, {3, 4, 5}}), 1u);
  EXPECT_EQ(count(with({{1, 1, 0}, {1, 2, 3}, {2, 1, 3}}), {{0, 1, 2}, {3, 4, 5}}), 1u);
  EXPECT_EQ(count(with({{1, 1, 5e-324}, {1, 2, 3}, {2, 1, 3}}), {{0, 1, 2}, {3, 4, 5}}), 0u);
  EXPECT_EQ(count(with({{4, 4, 0}, {4, 1, 0}, {5, 5, 0}}), {{0, 1, 2}, {3, 4, 5}}), 0u);
  // One vertex in common: a fan, through the other, overlapping in the plane.
  EXPECT_EQ(count(with({{-1, -1, 0}, {-2, -1, 1}}), {{0, 1, 2}, {0, 3, 4}}), 0u);
  EXPECT_EQ(count(with({{1, 1, -1}, {1, 1, 1}}), {{0, 1, 2}, {0, 3, 4}}), 1u);
  EXPECT_EQ(count(with({{1, 1, 0}, {2, 9, 0}}), {{0, 1, 2}, {0, 3, 4}}), 1u);
  EXPECT_EQ(count(with({{8, 0, 0}, {8, -1, 0}}), {{0, 1, 2}, {0, 3, 4}}), 1u);  // along an edge
  // One edge in common: flat, folded by a right angle, folded onto each other, folded as little as doubles can.
  EXPECT_EQ(count(with({{4, 4, 0}}), {{0, 1, 2}, {2, 1, 3}}), 0u);
  EXPECT_EQ(count(with({{1, 1, 3}}), {{0, 1, 2}, {2, 1, 3}}), 0u);
  EXPECT_EQ(count(with({{1, 1, 0}}), {{0, 1, 2}, {2, 1, 3}}), 1u);
  EXPECT_EQ(count(with({{1, 1, 5e-324}}), {{0, 1, 2}, {2, 1, 3}}), 0u);
  // The same triangle twice, by index, reversed, or at the same points.
  EXPECT_EQ(count(base, {{0, 1, 2}, {1, 2, 0}}), 1u);
  EXPECT_EQ(count(base, {{0, 1, 2}, {2, 1, 0}}), 1u);
  EXPECT_EQ(count(with(base), {{0, 1, 2}, {3, 4, 5}}), 1u);
  // Neighbours of a soup are neighbours.
  EXPECT_EQ(count(with({{4, 0, 0}, {0, 4, 0}, {4, 4, 0}}), {{0, 1, 2}, {3, 5, 4}}), 0u);
  // A triangle without area is no obstacle.
  EXPECT_EQ(count(with({{1, 1, -1}, {1, 1, 1}, {1, 1, 2}}), {{0, 1, 2}, {3, 4, 5}}), 0u);
}

TEST(SelfIntersections, OfDuplicatedAndCrossingSheets) {
  // Each triangle of the square lies there three times and shares only an edge with the other three.
  EXPECT_EQ(count_self_intersections(duplicated_triangles()), 6u);

  // Two crossing grids of n squares: along the line every square's two triangles meet both of the other's square.
  const TriangleMesh grid = grid_patch(6, 6);
  TriangleMesh upright = grid;
  for (Vec3& v : upright.vertices) v = {v.x + 0.25, 3.25, v.y - 2.75};
  const TriangleMesh cross = joined(grid, upright, {0, 0, 0});
  std::size_t pairs = 0;
  const auto overlap = [](const std::array<double, 2>& a, const std::array<double, 2>& b) {
    return a[0] <= b[1] && b[0] <= a[1];
  };
  // The segments in which triangles meet the common line y = 3.25, z = 0, by the lines' equations.
  std::vector<std::array<double, 2>> ours, theirs;
  for (int i = 0; i < 6; ++i) {
    ours.push_back({i + 0.25, i + 1.0});  // below the diagonal of [i, i + 1] x [3, 4]
    ours.push_back({i + 0.0, i + 0.25});
    theirs.push_back({i + 0.25 + 0.75, i + 0.25 + 1.0});  // at height 0.75 of their squares
    theirs.push_back({i + 0.25, i + 0.25 + 0.75});
  }
  for (const auto& a : ours)
    for (const auto& b : theirs) pairs += overlap(a, b);
  EXPECT_EQ(count_self_intersections(cross), pairs);
}

TEST(SelfIntersections, AgreeWithPiercedEdgesInSoup) {
  // In general position two triangles intersect if and only if an edge of one pierces the other.
  const TriangleMesh mesh = soup(150, 4);
  const auto volume = [](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    return dot(cross(b - a, c - a), d - a);
  };
  const auto pierces = [&](const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& t) {
    if ((volume(t[0], t[1], t[2], p) > 0) == (volume(t[0], t[1], t[2], q) > 0)) return false;
    const bool first = volume(p, q, t[0], t[1]) > 0;
    return first == (volume(p, q, t[1], t[2]) > 0) && first == (volume(p, q, t[2], t[0]) > 0);
  };
  const auto corners = [&](std::size_t i) {
    const Triangle& t = mesh.triangles[i];
    return std::array{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
  };
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const auto s = corners(i), t = corners(j);
      bool meet = false;
      for (std::size_t k = 0; k < 3; ++k)
        meet = meet || pierces(s[k], s[(k + 1) % 3], t) || pierces(t[k], t[(k + 1) % 3], s);
      pairs += meet;
    }
  EXPECT_GT(pairs, 100u);
  EXPECT_EQ(count_self_intersections(mesh), pairs);
}

TEST(SelfIntersections, OfOneTriangleThroughManyFarApart) {
  // Crosses of an upright and a lying triangle in a row, and one triangle through all that are upright.
  constexpr Index kCrosses = 10000;
  TriangleMesh mesh;
  const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto first = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {a, b, c});
    mesh.triangles.push_back({first, first + 1, first + 2});
  };
  add({-1, -0.05, -0.5}, {kCrosses, 0, -0.5}, {-1, 0.05, -0.5});
  for (Index i = 0; i < kCrosses; ++i) {
    const double x = i;
    add({x, -1, -1}, {x, 1, -1}, {x, 0, 1});
    add({x - 0.2, -0.1, 0}, {x + 0.2, -0.1, 0}, {x, 0.2, 0});
  }
  EXPECT_EQ(count_self_intersections(mesh), 2 * kCrosses);
  std::vector<std::array<Index, 2>> pairs;
  for (Index i = 0; i < kCrosses; ++i) pairs.push_back({0, 2 * i + 1});
  for (Index i = 0; i < kCrosses; ++i) pairs.push_back({2 * i + 1, 2 * i + 2});
  EXPECT_EQ(find_self_intersections(mesh), pairs);
}

TEST(Quality, OfRealModels) {
  for (const char* name : {"bunny.off", "igea.ply", "homer.obj"}) {
    const std::string model = shared_model(name);
    if (model.empty()) continue;
    const TriangleMesh mesh = read_mesh(model);
    const QualityReport report = measure_quality(mesh);
    EXPECT_TRUE(report.topology.manifold && report.topology.closed && report.topology.oriented) << name;
    EXPECT_EQ(report.topology.euler, 2) << name;
    EXPECT_EQ(count_self_intersections(mesh), 0u) << name;
  }
}

// Turning any triangles of an orientable mesh over is undone, up to the side that most of them were on; a Moebius strip
// cannot be.
TEST(Orient, UndoesFlips) {
  for (const TriangleMesh& mesh : {icosphere(2), torus(20, 12), wavy_patch(6), two_spheres(), pages()}) {
    SplitMix64 random(3);
    std::vector<Triangle> flipped = mesh.triangles;
    for (Triangle& t : flipped)
      if (random.unit() < 0.3) std::swap(t[1], t[2]);
    orient(flipped, mesh.vertices.size());
    const auto cyclic = [](Triangle t) {
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
      return t;
    };
    const MeshTopology want = analyse_topology(mesh.triangles, mesh.vertices.size());
    const MeshTopology got = analyse_topology(flipped, mesh.vertices.size());
    EXPECT_EQ(got.oriented, want.oriented);
    if (want.components > 1 || want.non_manifold_edges > 0) continue;
    for (std::size_t t = 0; t < flipped.size(); ++t) EXPECT_EQ(cyclic(flipped[t]), cyclic(mesh.triangles[t]));
  }
}

// A square whose diagonal triangle at a corner has two marked edges.
TEST(Quality, FreeFiguresLeaveOutWhatFeaturesImpose) {
  TriangleMesh mesh{{{0, 0, 0}, {4, 0, 0}, {4, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
  const QualityReport plain = measure_quality(mesh);
  EXPECT_EQ(plain.q_min_free, plain.q_min);
  EXPECT_EQ(plain.theta_min_free, plain.theta_min);
  EXPECT_EQ(plain.theta_max_free, plain.theta_max);
  mesh.feature_edges = {{0, 1}, {1, 2}, {2, 3}, {0, 3}};
  const QualityReport marked = measure_quality(mesh);
  EXPECT_EQ(marked.theta_max, plain.theta_max);
  EXPECT_NEAR(marked.theta_max_free, std::atan2(4, 1) * 180 / std::numbers::pi, 1e-9);  // the right angles are imposed
  EXPECT_EQ(marked.theta_min_free, plain.theta_min);
  EXPECT_EQ(marked.theta_below_30_free, 100);
  mesh.feature_edges = {{0, 1}, {0, 2}};  // the angle of atan(1/4) at vertex 0 of the first triangle
  const QualityReport acute = measure_quality(mesh);
  EXPECT_NEAR(acute.theta_min_free, plain.theta_min, 1e-12);  // the second has the same angle, free, at vertex 2
  EXPECT_EQ(acute.theta_below_30, 100);
  EXPECT_EQ(acute.theta_below_30_free, 50);
  mesh.triangles.pop_back();
  EXPECT_NEAR(measure_quality(mesh).theta_min_free, std::atan2(4, 1) * 180 / std::numbers::pi, 1e-9);
}

}  // namespace
}  // namespace bisector::test
