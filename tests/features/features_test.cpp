// Features: what a part made by CAD has, and a smooth or noisy surface has not; corners and curves; noise of normals.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/features.h"
#include "bisector/io.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "features/normals.h"
#include "support/models.h"

namespace bisector::test {
namespace {

constexpr double kPi = std::numbers::pi;
using Edge = std::array<Index, 2>;

FeatureGraph detect(const TriangleMesh& mesh, FeatureMode mode = FeatureMode::automatic, double angle = 40) {
  FeatureOptions options;
  options.mode = mode;
  options.angle = angle;
  return detect_features(mesh, options);
}

std::size_t count(const FeatureGraph& graph, FeatureKind kind) {
  return static_cast<std::size_t>(
      std::count_if(graph.curves.begin(), graph.curves.end(), [&](const FeatureCurve& c) { return c.kind == kind; }));
}

std::size_t count_closed(const FeatureGraph& graph) {
  return static_cast<std::size_t>(
      std::count_if(graph.curves.begin(), graph.curves.end(), [](const FeatureCurve& c) { return c.closed; }));
}

// What the header promises of every graph.
void expect_consistent(const FeatureGraph& graph) {
  EXPECT_TRUE(std::is_sorted(graph.edges.begin(), graph.edges.end()));
  EXPECT_TRUE(std::is_sorted(graph.corners.begin(), graph.corners.end()));
  const std::set<Index> corners(graph.corners.begin(), graph.corners.end());
  std::vector<Edge> covered;
  for (const FeatureCurve& curve : graph.curves) {
    const std::size_t n = curve.vertices.size();
    ASSERT_GE(n, 2u);
    for (std::size_t i = 0; i + 1 < n + curve.closed; ++i) {
      const Index a = curve.vertices[i], b = curve.vertices[(i + 1) % n];
      covered.push_back({std::min(a, b), std::max(a, b)});
    }
    for (std::size_t i = 0; i < n; ++i)
      EXPECT_EQ(corners.count(curve.vertices[i]), !curve.closed && (i == 0 || i + 1 == n) ? 1u : 0u);
  }
  std::sort(covered.begin(), covered.end());
  EXPECT_EQ(covered, graph.edges);
  std::map<Index, int> degree;
  for (const Edge& e : graph.edges)
    for (const Index v : e) ++degree[v];
  for (const auto& [v, d] : degree) EXPECT_TRUE(d == 2 || corners.count(v)) << v;
}

// A profile turned about z with n segments: points (r, z) from top to bottom, oriented outward; radius 0 is a pole.
TriangleMesh lathe(const std::vector<std::array<double, 2>>& profile, int n) {
  TriangleMesh mesh;
  std::vector<std::vector<Index>> rings;
  for (const auto& [r, z] : profile) {
    std::vector<Index> ring(static_cast<std::size_t>(n), static_cast<Index>(mesh.vertices.size()));
    for (int i = 0; i < (r > 0 ? n : 1); ++i) {
      ring[static_cast<std::size_t>(i)] = static_cast<Index>(mesh.vertices.size());
      mesh.vertices.push_back({r * std::cos(2 * kPi * i / n), r * std::sin(2 * kPi * i / n), z});
    }
    rings.push_back(ring);
  }
  for (std::size_t k = 0; k + 1 < rings.size(); ++k)
    for (std::size_t i = 0; i < rings[k].size(); ++i) {
      const std::size_t j = (i + 1) % rings[k].size();
      const Triangle upper{rings[k][i], rings[k + 1][i], rings[k][j]};
      const Triangle lower{rings[k][j], rings[k + 1][i], rings[k + 1][j]};
      if (upper[0] != upper[2]) mesh.triangles.push_back(upper);
      if (lower[1] != lower[2]) mesh.triangles.push_back(lower);
    }
  return mesh;
}

// A height field over [0, 1]^2 with n x n squares.
template <class Height>
TriangleMesh height_field(int n, const Height& height) {
  TriangleMesh mesh = grid_patch(n, n);
  for (Vec3& p : mesh.vertices) {
    p = (1.0 / n) * p;
    p.z = height(p.x, p.y);
  }
  return mesh;
}

void turn(TriangleMesh& mesh, double x, double z) {
  for (Vec3& p : mesh.vertices) {
    p = {p.x, std::cos(x) * p.y - std::sin(x) * p.z, std::sin(x) * p.y + std::cos(x) * p.z};
    p = {std::cos(z) * p.x - std::sin(z) * p.y, std::sin(z) * p.x + std::cos(z) * p.y, p.z};
  }
}

void add_noise(TriangleMesh& mesh, double of_diagonal) {
  const double size = of_diagonal * bounding_box(mesh.vertices).diagonal();
  SplitMix64 random(7);
  for (Vec3& p : mesh.vertices)
    for (int k = 0; k < 3; ++k) p[k] += random.range(-size, size);
}

TEST(Features, ABoxHasTwelveCurvesAndEightCorners) {
  for (const int n : {1, 2, 5, 16})
    for (const double angle : {0.0, 0.7, 2.1}) {
      TriangleMesh mesh = box(n);
      turn(mesh, angle, 1.3 * angle);
      for (const FeatureMode mode : {FeatureMode::automatic, FeatureMode::degrees}) {
        const FeatureGraph graph = detect(mesh, mode);
        expect_consistent(graph);
        EXPECT_EQ(graph.edges.size(), static_cast<std::size_t>(12 * n));
        EXPECT_EQ(graph.corners.size(), 8u);
        EXPECT_EQ(graph.curves.size(), 12u);
        EXPECT_EQ(count(graph, FeatureKind::crease), 12u);
      }
      EXPECT_TRUE(detect(mesh, FeatureMode::none).edges.empty());
    }
}

TEST(Features, OrientationDoesNotMatter) {
  TriangleMesh mesh = box(4);
  const FeatureGraph expected = detect(mesh);
  SplitMix64 random(3);
  for (Triangle& t : mesh.triangles)
    if (random.below(2)) std::swap(t[0], t[1]);
  const FeatureGraph graph = detect(mesh);
  EXPECT_EQ(graph.edges, expected.edges);
  EXPECT_EQ(graph.corners, expected.corners);
}

TEST(Features, ACylinderHasTwoClosedCurves) {
  for (const int n : {12, 20, 100})
    for (const int levels : {1, 8}) {
      std::vector<std::array<double, 2>> profile{{0, 1}, {0.5, 1}};
      for (int k = 0; k <= levels; ++k) profile.push_back({1, 1 - 2.0 * k / levels});
      profile.push_back({0, -1});
      const FeatureGraph graph = detect(lathe(profile, n));
      expect_consistent(graph);
      EXPECT_EQ(graph.edges.size(), static_cast<std::size_t>(2 * n));
      EXPECT_TRUE(graph.corners.empty());
      ASSERT_EQ(graph.curves.size(), 2u);
      EXPECT_EQ(count_closed(graph), 2u);
    }
}

TEST(Features, AConeHasATipAndAClosedCurve) {
  for (const int levels : {1, 6}) {
    std::vector<std::array<double, 2>> profile;
    for (int k = 0; k <= levels; ++k) profile.push_back({1.0 * k / levels, 2 - 2.0 * k / levels});
    profile.push_back({0, 0});
    const FeatureGraph graph = detect(lathe(profile, 48));
    expect_consistent(graph);
    EXPECT_EQ(graph.corners, std::vector<Index>{0});
    ASSERT_EQ(graph.curves.size(), 1u);
    EXPECT_TRUE(graph.curves[0].closed);
    EXPECT_EQ(graph.edges.size(), 48u);
  }
}

TEST(Features, AnLBracketKeepsItsValley) {
  // Six corners extruded; every outer edge and the valley.
  const std::vector<Vec3> outline{{0, 0, 0}, {4, 0, 0}, {4, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
  TriangleMesh mesh;
  for (const double z : {0.0, 2.0})
    for (const Vec3& p : outline) mesh.vertices.push_back({p.x, p.y, z});
  for (const Triangle& t : {Triangle{0, 1, 3}, {1, 2, 3}, {0, 3, 5}, {3, 4, 5}}) {
    mesh.triangles.push_back({t[0], t[2], t[1]});
    mesh.triangles.push_back({t[0] + 6, t[1] + 6, t[2] + 6});
  }
  for (Index i = 0; i < 6; ++i) {
    const Index j = (i + 1) % 6;
    mesh.triangles.push_back({i, j, j + 6});
    mesh.triangles.push_back({i, j + 6, i + 6});
  }
  const FeatureGraph graph = detect(mesh);
  expect_consistent(graph);
  EXPECT_EQ(graph.edges.size(), 18u);
  EXPECT_EQ(graph.corners.size(), 12u);
  EXPECT_EQ(graph.curves.size(), 18u);
  EXPECT_TRUE(std::binary_search(graph.edges.begin(), graph.edges.end(), Edge{3, 9}));
}

TEST(Features, ACreaseThatFadesOutEndsInADart) {
  // A roof whose fold falls from 90 degrees at x = 0 to nothing at x = 1.
  const int n = 40;
  const TriangleMesh mesh = height_field(n, [](double x, double y) { return -(1 - x) * std::abs(y - 0.5); });
  const FeatureGraph graph = detect(mesh);
  expect_consistent(graph);
  ASSERT_EQ(count(graph, FeatureKind::crease), 1u);
  const auto curve = std::find_if(graph.curves.begin(), graph.curves.end(),
                                  [](const FeatureCurve& c) { return c.kind == FeatureKind::crease; });
  double farthest = 0;
  for (const Index v : curve->vertices) {
    EXPECT_EQ(mesh.vertices[v].y, 0.5);
    farthest = std::max(farthest, mesh.vertices[v].x);
  }
  const double fold = 2 * std::atan(1 - farthest) * 180 / kPi;
  EXPECT_GT(fold, 5);   // it does not go on where there is none
  EXPECT_LT(fold, 20);  // and is followed beyond what alone would not be a crease
  EXPECT_EQ(curve->vertices.size(), static_cast<std::size_t>(std::lround(farthest * n)) + 1);
}

TEST(Features, SmoothSurfacesHaveNone) {
  const TriangleMesh turned = lathe({{0, 1}, {0.8, 0.6}, {1, 0}, {0.8, -0.6}, {0, -1}}, 16);
  for (const TriangleMesh& mesh : {icosphere(2), icosphere(5), torus(40, 20), turned}) {
    const FeatureGraph graph = detect(mesh);
    EXPECT_TRUE(graph.edges.empty());
    EXPECT_TRUE(graph.corners.empty());
  }
}

TEST(Features, NoiseHasNone) {
  TriangleMesh mesh = icosphere(6);
  add_noise(mesh, 0.004);
  const FeatureGraph folds = detect(mesh, FeatureMode::degrees);
  EXPECT_GT(folds.edges.size(), mesh.triangles.size() / 10);  // there would be enough to take for creases
  EXPECT_LT(detect(mesh).edges.size(), folds.edges.size() / 1000);
}

TEST(Features, BordersAreAlwaysKept) {
  for (const FeatureMode mode : {FeatureMode::none, FeatureMode::automatic, FeatureMode::degrees}) {
    const TriangleMesh disk = lathe({{0, 0}, {0.5, 0}, {1, 0}}, 32);
    const FeatureGraph graph = detect(disk, mode);
    expect_consistent(graph);
    EXPECT_TRUE(graph.corners.empty());
    ASSERT_EQ(graph.curves.size(), 1u);
    EXPECT_TRUE(graph.curves[0].closed);
    EXPECT_EQ(graph.curves[0].kind, FeatureKind::border);
    EXPECT_EQ(graph.edges.size(), 32u);

    const FeatureGraph square = detect(grid_patch(5, 7), mode);
    EXPECT_EQ(square.corners.size(), 4u);
    EXPECT_EQ(square.curves.size(), 4u);
    EXPECT_EQ(square.edges.size(), 24u);
  }
}

TEST(Features, AMoebiusStripHasOneBorder) {
  const int n = 60;
  TriangleMesh mesh;
  for (int i = 0; i < n; ++i)
    for (const double w : {-0.3, 0.0, 0.3}) {
      const double a = 2 * kPi * i / n;
      mesh.vertices.push_back(
          {(1 + w * std::cos(a / 2)) * std::cos(a), (1 + w * std::cos(a / 2)) * std::sin(a), w * std::sin(a / 2)});
    }
  for (Index i = 0; i < n; ++i)
    for (Index k = 0; k < 2; ++k) {
      const Index j = (i + 1) % n;
      const bool over = j == 0;
      const Index a = 3 * i + k, b = 3 * i + k + 1, c = over ? 2 - k : 3 * j + k, d = over ? 1 - k : 3 * j + k + 1;
      mesh.triangles.push_back({a, c, b});
      mesh.triangles.push_back({b, c, d});
    }
  const FeatureGraph graph = detect(mesh);
  expect_consistent(graph);
  EXPECT_TRUE(graph.corners.empty());
  ASSERT_EQ(graph.curves.size(), 1u);
  EXPECT_TRUE(graph.curves[0].closed);
  EXPECT_EQ(graph.edges.size(), 2u * n);
}

TEST(Features, ThreeSheetsMeetInANonManifoldCurve) {
  const FeatureGraph graph = detect(pages());
  expect_consistent(graph);
  EXPECT_EQ(count(graph, FeatureKind::non_manifold), 1u);
  for (const Index v : {0u, 1u}) EXPECT_TRUE(std::binary_search(graph.corners.begin(), graph.corners.end(), v));
}

TEST(Features, AVertexOfTwoFansIsACorner) {
  // Two spheres that touch at a vertex.
  const TriangleMesh one = icosphere(3);
  TriangleMesh mesh = one;
  const Index n = static_cast<Index>(one.vertices.size());
  for (const Vec3& p : one.vertices)
    mesh.vertices.push_back({2 * one.vertices[0].x - p.x, 2 * one.vertices[0].y - p.y, 2 * one.vertices[0].z - p.z});
  for (const Triangle& t : one.triangles) {
    Triangle other{t[1], t[0], t[2]};
    for (Index& v : other) v = v == 0 ? 0 : v + n;
    mesh.triangles.push_back(other);
  }
  for (const FeatureMode mode : {FeatureMode::none, FeatureMode::automatic}) {
    const FeatureGraph graph = detect(mesh, mode);
    EXPECT_TRUE(graph.edges.empty());
    EXPECT_EQ(graph.corners, std::vector<Index>{0});
  }
}

TEST(Features, LabelsAndGivenEdgesAreFeatures) {
  TriangleMesh mesh = grid_patch(6, 6);
  const auto centre_x = [&](const Triangle& t) {
    return (mesh.vertices[t[0]].x + mesh.vertices[t[1]].x + mesh.vertices[t[2]].x) / 3;
  };
  for (const Triangle& t : mesh.triangles) mesh.labels.push_back(centre_x(t) < 3 ? 7 : -2);
  FeatureGraph graph = detect(mesh);
  expect_consistent(graph);
  ASSERT_EQ(count(graph, FeatureKind::label), 1u);
  EXPECT_EQ(graph.edges.size(), 24u + 6u);
  EXPECT_EQ(graph.corners.size(), 6u);  // where labels change, a border has a corner
  EXPECT_EQ(detect(mesh, FeatureMode::none).edges.size(), 24u);

  // Three labels in a row across a border of labels: the pair changes on the way.
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& v = mesh.triangles[t];
    const double y = (mesh.vertices[v[0]].y + mesh.vertices[v[1]].y + mesh.vertices[v[2]].y) / 3;
    if (mesh.labels[t] == 7 && y < 2) mesh.labels[t] = 1;
  }
  EXPECT_EQ(count(detect(mesh), FeatureKind::label), 3u);

  mesh.labels.clear();
  const Index a = mesh.triangles[20][0], b = mesh.triangles[20][1];
  mesh.feature_edges = {{b, a}};
  graph = detect(mesh);
  expect_consistent(graph);
  EXPECT_EQ(count(graph, FeatureKind::given), 1u);
  EXPECT_EQ(graph.edges.size(), 25u);
  EXPECT_EQ(detect(mesh, FeatureMode::none).edges.size(), 24u);
  FeatureOptions options;
  options.mode = FeatureMode::none;
  options.given = {{a, b}};
  EXPECT_EQ(detect_features(mesh, options).edges.size(), 25u);
}

TEST(Features, WhatIsFoundCanBeGivenBack) {
  TriangleMesh mesh = box(3);
  const FeatureGraph found = detect(mesh);
  mesh.feature_edges = found.edges;
  const FeatureGraph again = detect(mesh);
  EXPECT_EQ(again.edges, found.edges);
  EXPECT_EQ(again.corners, found.corners);
  EXPECT_EQ(again.curves.size(), found.curves.size());
}

TEST(Features, CornersAreTurnsAcrossWhatIsTiny) {
  // Borders of flat polygons, each a fan about its centre.
  const auto corners = [](std::vector<Vec3> outline) {
    TriangleMesh mesh;
    mesh.vertices = outline;
    Vec3 centre;
    for (const Vec3& p : outline) centre += (1.0 / static_cast<double>(outline.size())) * p;
    mesh.vertices.push_back(centre);
    const Index n = static_cast<Index>(outline.size());
    for (Index i = 0; i < n; ++i) mesh.triangles.push_back({i, (i + 1) % n, n});
    const FeatureGraph graph = detect(mesh);
    expect_consistent(graph);
    return graph.corners.size();
  };
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  EXPECT_EQ(corners(square), 4u);
  // A bevel of 0.01 is one corner, not two and not none.
  EXPECT_EQ(corners({{0, 0, 0}, {0.99, 0, 0}, {1, 0.01, 0}, {1, 1, 0}, {0, 1, 0}}), 4u);
  // A zigzag of 0.01 in an edge is none.
  EXPECT_EQ(corners({{0, 0, 0}, {0.5, 0, 0}, {0.5, 0.01, 0}, {1, 0.01, 0}, {1, 1, 0}, {0, 1, 0}}), 4u);
  std::vector<Vec3> circle;
  for (int i = 0; i < 12; ++i) circle.push_back({std::cos(2 * kPi * i / 12), std::sin(2 * kPi * i / 12), 0});
  EXPECT_EQ(corners(circle), 0u);
  // A quarter of a fine circle between long straight edges.
  std::vector<Vec3> rounded;
  for (int i = 0; i <= 9; ++i)
    rounded.push_back({0.9 + 0.1 * std::sin(kPi / 18 * i), 0.1 - 0.1 * std::cos(kPi / 18 * i), 0});
  rounded.push_back({1, 1, 0});
  rounded.push_back({0, 1, 0});
  rounded.push_back({0, 0, 0});
  EXPECT_EQ(corners(rounded), 3u);
}

TEST(Features, LooksThroughTrianglesWithoutNormal) {
  // A roof whose ridge has a vertex that only the left side knows: a collinear triangle closes the right side.
  for (const double off : {0.0, 1e-9}) {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 1}, {2, off, 1}, {4, 0, 1}, {0, -1, 0}, {4, -1, 0}, {0, 1, 0}, {4, 1, 0}};
    mesh.triangles = {{3, 1, 0}, {3, 4, 1}, {4, 2, 1}, {0, 2, 5}, {5, 2, 6}, {0, 1, 2}};
    for (const FeatureMode mode : {FeatureMode::automatic, FeatureMode::degrees}) {
      const FeatureGraph graph = detect(mesh, mode);
      expect_consistent(graph);
      EXPECT_EQ(count(graph, FeatureKind::crease), 1u);
      for (const Edge e : {Edge{0, 1}, Edge{1, 2}})
        EXPECT_TRUE(std::binary_search(graph.edges.begin(), graph.edges.end(), e));
      EXPECT_FALSE(std::binary_search(graph.edges.begin(), graph.edges.end(), Edge{0, 2}));
    }
  }
  // A flat plate with a sliver that a rounding has turned upright: no crease at all.
  TriangleMesh plate;
  plate.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1e-7, 1e-6}, {1, -1, 0}, {1, 1, 0}};
  plate.triangles = {{0, 4, 1}, {4, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 5}, {3, 2, 5}};
  for (const FeatureMode mode : {FeatureMode::automatic, FeatureMode::degrees})
    EXPECT_EQ(count(detect(plate, mode), FeatureKind::crease), 0u);
  EXPECT_NO_THROW(detect(needles()));
  EXPECT_NO_THROW(detect(collinear_among_good()));
  EXPECT_NO_THROW(detect(duplicated_triangles()));
}

TEST(Features, SizeDoesNotMatter) {
  for (const TriangleMesh& mesh : {box(4), lathe({{0, 2}, {0.5, 1}, {1, 0}, {0, 0}}, 24)}) {
    const FeatureGraph expected = detect(mesh);
    for (const double scale : {0x1p-300, 0x1p300}) {
      TriangleMesh scaled = mesh;
      for (Vec3& p : scaled.vertices) p *= scale;
      const FeatureGraph graph = detect(scaled);
      EXPECT_EQ(graph.edges, expected.edges);
      EXPECT_EQ(graph.corners, expected.corners);
    }
  }
}

TEST(Features, PolyhedraOfFewFacesHaveAllTheirEdges) {
  // A prism of eight sides, a tetrahedron, and a block whose upper edges are cut off at 45 degrees.
  EXPECT_EQ(detect(lathe({{0, 1}, {1, 1}, {1, -1}, {0, -1}}, 8)).edges.size(), 24u);
  TriangleMesh tetrahedron;
  tetrahedron.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const FeatureGraph graph = detect(tetrahedron);
  EXPECT_EQ(graph.edges.size(), 6u);
  EXPECT_EQ(graph.corners.size(), 4u);
  const FeatureGraph of_cut = detect(lathe({{0, 1}, {0.8, 1}, {1, 1 - 0.2 * std::sqrt(0.5)}, {1, -1}, {0, -1}}, 4));
  expect_consistent(of_cut);
  EXPECT_EQ(of_cut.edges.size(), 12u + 8u);
}

TEST(Features, PlatesAndBarsHaveTwelveCurves) {
  for (const Vec3& extent : {Vec3{1, 1, 0.01}, Vec3{100, 1, 1}, Vec3{1000, 300, 1}})
    for (const int n : {1, 2, 4}) {
      TriangleMesh mesh = box(n);
      for (Vec3& p : mesh.vertices) p = {extent.x * p.x, extent.y * p.y, extent.z * p.z};
      const FeatureGraph graph = detect_features(mesh);
      EXPECT_EQ(graph.curves.size(), 12u) << extent.x << ' ' << n;
      EXPECT_EQ(graph.corners.size(), 8u) << extent.x << ' ' << n;
    }
}

TEST(Features, ThreadsDoNotMatter) {
  const TriangleMesh mesh = box(20);
  const FeatureGraph expected = detect(mesh);
  const ThreadLimit limit(1);
  const FeatureGraph graph = detect(mesh);
  EXPECT_EQ(graph.edges, expected.edges);
  EXPECT_EQ(graph.corners, expected.corners);
}

TEST(Features, RefusesWhatMakesNoSense) {
  TriangleMesh mesh = box(2);
  EXPECT_THROW(detect(mesh, FeatureMode::degrees, 0), Error);
  EXPECT_THROW(detect(mesh, FeatureMode::degrees, std::nan("")), Error);
  FeatureOptions options;
  options.given = {{0, 0}};
  EXPECT_THROW(detect_features(mesh, options), Error);
  options.given = {{0, 4000000}};
  EXPECT_THROW(detect_features(mesh, options), Error);
  mesh.labels = {1, 2};
  EXPECT_THROW(detect(mesh), Error);
  EXPECT_TRUE(detect(TriangleMesh{}).edges.empty());
}

TEST(Features, RealScansHaveHardlyAny) {
  for (const char* name : {"bunny.off", "igea.ply", "homer.obj", "elephant.off", "camel.off"}) {
    const std::string path = shared_model(name);
    if (path.empty()) GTEST_SKIP();
    const TriangleMesh mesh = read_mesh(path);
    EXPECT_LT(detect(mesh).edges.size(), mesh.triangles.size() / 1000) << name;
  }
}

TEST(Features, RealPartsHaveAllOfThem) {
  for (const char* name : {"fandisk.off", "anchor.off"}) {
    const std::string path = shared_model(name);
    if (path.empty()) GTEST_SKIP();
    const TriangleMesh mesh = read_mesh(path);
    const FeatureGraph graph = detect(mesh);
    expect_consistent(graph);
    // Every edge that anyone would call sharp, and little else.
    const std::vector<Edge> sharp = detect(mesh, FeatureMode::degrees, 60).edges;
    EXPECT_TRUE(std::includes(graph.edges.begin(), graph.edges.end(), sharp.begin(), sharp.end())) << name;
    const std::vector<Edge> folded = detect(mesh, FeatureMode::degrees, 8).edges;
    EXPECT_TRUE(std::includes(folded.begin(), folded.end(), graph.edges.begin(), graph.edges.end())) << name;
  }
}

TEST(Noise, RoughnessOfASmoothSurfaceVanishes) {
  EXPECT_LT(normal_roughness(icosphere(5), 0.1), 1);
  EXPECT_LT(normal_roughness(box(20), 0.1), 0.1);  // creases are at few points
  EXPECT_EQ(normal_roughness(TriangleMesh{}, 1), 0);
}

TEST(Noise, RoughnessIsThatOfTheNoise) {
  // Uniform noise of size s turns the normals of triangles with edge e by some s / e, whatever the length looked at.
  double last = 0;
  for (const double size : {0.001, 0.002, 0.004}) {
    TriangleMesh mesh = icosphere(5);
    add_noise(mesh, size);
    const double near = normal_roughness(mesh, 0.1), far = normal_roughness(mesh, 0.2);
    EXPECT_NEAR(far / near, 1, 0.1);
    EXPECT_GT(near, 1.5 * last);
    last = near;
    SplitMix64 random(1);
    for (Triangle& t : mesh.triangles)
      if (random.below(2)) std::swap(t[0], t[1]);
    EXPECT_NEAR(normal_roughness(mesh, 0.1) / near, 1, 0.02);  // other points, but orientation does not matter
  }
}

TEST(Noise, TellsNoisyFromDetailed) {
  TriangleMesh sphere = icosphere(6);
  EXPECT_FALSE(has_noisy_normals(sphere, 10000));
  add_noise(sphere, 0.002);
  for (const std::size_t count : {1000u, 10000u, 30000u}) EXPECT_TRUE(has_noisy_normals(sphere, count));
  EXPECT_FALSE(has_noisy_normals(box(10), 1000));
  for (const char* name : {"bunny.off", "fandisk.off", "anchor.off", "elephant.off", "camel.off", "face.obj",
                           "homer.obj", "beetle.obj", "igea.ply"}) {
    const std::string path = shared_model(name);
    if (path.empty()) GTEST_SKIP();
    TriangleMesh mesh = read_mesh(path);
    for (const std::size_t count : {1000u, 10000u}) EXPECT_FALSE(has_noisy_normals(mesh, count)) << name;
    if (std::string(name) != "igea.ply") continue;
    add_noise(mesh, 0.002);
    EXPECT_TRUE(has_noisy_normals(mesh, 10000));
  }
}

// A scan of a smooth surface with needles that are folded up to half a turn.
TEST(Features, FoldedNeedlesAreNoCreases) {
  const FeatureGraph graph = detect_features(read_mesh(BISECTOR_SOURCE_DIR "/examples/smooth.off"));
  EXPECT_TRUE(graph.edges.empty());
}

}  // namespace
}  // namespace bisector::test
