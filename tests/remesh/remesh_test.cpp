// Remeshing end to end on generated surfaces: counts, topology, quality, reproducibility, and input it has to refuse.
#include "remesh/remesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "backend/project.h"
#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "mesh/joining.h"
#include "remesh/slivers.h"
#include "remesh/topology_control.h"
#include "support/diagram.h"
#include "support/figure_of_eight.h"
#include "support/models.h"
#include "support/shuffled.h"

namespace bisector::test {
namespace {

struct Case {
  std::string name;
  TriangleMesh mesh;
  std::size_t vertices;
  bool smooth;  // and closed: no sharp edges that cells have to straddle
};

void PrintTo(const Case& problem, std::ostream* out) { *out << problem.name; }

std::vector<Case> cases() {
  return {{"icosphere_300", icosphere(4), 300, true},     {"icosphere_2000", icosphere(5), 2000, true},
          {"torus_600", torus(80, 48), 600, true},        {"torus_2000", torus(80, 48), 2000, true},
          {"two_spheres_500", two_spheres(), 500, false}, {"box_1000", box(4), 1000, false},
          {"box_of_12_500", box(1), 500, false},          {"wavy_patch_700", wavy_patch(40), 700, false}};
}

RemeshOptions options_for(std::size_t vertices) {
  RemeshOptions options;
  options.vertices = vertices;
  return options;
}

double distance_to(const TriangleMesh& mesh, const Vec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& [a, b, c] : mesh.triangles)
    best = std::min(best, norm2(nearest_on_triangle(p, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]) - p));
  return std::sqrt(best);
}

bool same_mesh(const TriangleMesh& a, const TriangleMesh& b) {
  return a.triangles == b.triangles && same_bits(a.vertices, b.vertices);
}

class Remesh : public testing::TestWithParam<Case> {};

TEST_P(Remesh, KeepsTheTopologyAndMakesGoodTriangles) {
  const auto& [name, mesh, vertices, smooth] = GetParam();
  const RemeshResult result = remesh(mesh, options_for(vertices));
  const MeshTopology want = analyse_topology(mesh.triangles, mesh.vertices.size());
  const MeshTopology got = analyse_topology(result.mesh.triangles, result.mesh.vertices.size());
  EXPECT_EQ(result.mesh.vertices.size(), vertices);
  EXPECT_TRUE(got.manifold);
  EXPECT_TRUE(got.oriented);
  EXPECT_EQ(got.closed, want.closed);
  EXPECT_EQ(got.euler, want.euler);
  EXPECT_EQ(got.components, want.components);
  EXPECT_EQ(got.boundary_edges == 0, want.boundary_edges == 0);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.topology.euler, got.euler);
  EXPECT_EQ(result.input_topology.euler, want.euler);
  EXPECT_EQ(result.untiled, 0u);
  EXPECT_EQ(count_self_intersections(result.mesh), 0u);
  EXPECT_GT(result.iterations, 0);
  EXPECT_GE(result.evaluations, result.iterations);
  const QualityReport quality = measure_quality(result.mesh);
  EXPECT_GT(quality.q_ave, 0.8);
  if (smooth) {
    EXPECT_GT(quality.theta_min, 25);
    EXPECT_GT(quality.q_ave, 0.9);
    EXPECT_GT(quality.theta_min_ave, 50);
    EXPECT_GT(quality.valence6, 0.7);
  }
  const double tolerance = 1e-9 * bounding_box(mesh.vertices).diagonal();
  for (const Vec3& x : result.mesh.vertices) ASSERT_LE(distance_to(mesh, x), tolerance);
  // Oriented as the input: the signed volumes agree in sign, and closely for fine meshes.
  if (!want.closed) return;
  const auto volume = [](const TriangleMesh& m) {
    double sum = 0;
    for (const auto& [a, b, c] : m.triangles) sum += dot(m.vertices[a], cross(m.vertices[b], m.vertices[c])) / 6;
    return sum;
  };
  EXPECT_NEAR(volume(result.mesh), volume(mesh), 0.15 * volume(mesh));
}

TEST_P(Remesh, IsReproducible) {
  const auto& [name, mesh, vertices, smooth] = GetParam();
  RemeshOptions options = options_for(std::min<std::size_t>(vertices, 600));
  options.threads = 1;
  const TriangleMesh reference = remesh(mesh, options).mesh;
  options.threads = 2;
  EXPECT_TRUE(same_mesh(remesh(mesh, options).mesh, reference)) << "2 threads";
  options.random_seed = 2;
  EXPECT_FALSE(same_mesh(remesh(mesh, options).mesh, reference)) << "another random seed";
}

TEST_P(Remesh, IsTheSameFromEitherSourceOfNeighbours) {
  const auto& [name, mesh, vertices, smooth] = GetParam();
  RemeshOptions options = options_for(std::min<std::size_t>(vertices, 600));
  const TriangleMesh reference = remesh(mesh, options).mesh;
  options.compute.neighbours = NeighbourSource::delaunay;
  EXPECT_TRUE(same_mesh(remesh(mesh, options).mesh, reference));
}

INSTANTIATE_TEST_SUITE_P(Surfaces, Remesh, testing::ValuesIn(cases()),
                         [](const auto& instance) { return instance.param.name; });

// A plate whose cells reach through it wherever they are wider than it is thick.
TEST(RemeshInput, MayBeListedInAnyOrder) {
  for (const TriangleMesh& mesh : {icosphere(4), box(4), wavy_patch(40)}) {
    RemeshOptions options = options_for(400);
    options.sizing.kind = DensityKind::attribute;
    for (const Vec3& v : mesh.vertices) options.sizing.attribute.push_back(2 + v.x);
    options.features.given = {{mesh.triangles[7][0], mesh.triangles[7][1]}};
    const RemeshResult a = remesh(mesh, options);
    TriangleMesh marked = mesh;
    marked.feature_edges = options.features.given;  // to see which edge of the other it is
    const TriangleMesh other = shuffled(marked, 5);
    options.features.given = other.feature_edges;
    for (std::size_t v = 0; v < other.vertices.size(); ++v) options.sizing.attribute[v] = 2 + other.vertices[v].x;
    const RemeshResult b = remesh(other, options);
    EXPECT_TRUE(same_mesh(a.mesh, b.mesh));
    EXPECT_EQ(a.evaluations, b.evaluations);
    EXPECT_EQ(a.mesh.feature_edges, b.mesh.feature_edges);
  }
}

TEST(RemeshInput, MayHaveVerticesThatNoTriangleUses) {
  const TriangleMesh mesh = wavy_patch(40);
  TriangleMesh other = mesh;
  other.vertices.insert(other.vertices.begin(), {{0, 0, 0}, {1e6, 0, 0}});
  other.vertices.insert(other.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
  for (Triangle& t : other.triangles)
    for (Index& v : t) v += 2;
  RemeshOptions options = options_for(400);
  options.keep_vertices = {mesh.triangles[100][0]};
  options.sizing.kind = DensityKind::attribute;
  for (const Vec3& v : mesh.vertices) options.sizing.attribute.push_back(2 + v.x);
  const RemeshResult a = remesh(mesh, options);
  std::vector<double>& densities = options.sizing.attribute;
  densities.insert(densities.begin(), {1e-9, 1e9});
  densities.resize(other.vertices.size(), 1);
  options.keep_vertices[0] += 2;
  const RemeshResult b = remesh(other, options);
  EXPECT_TRUE(same_mesh(a.mesh, b.mesh));
  ASSERT_EQ(a.kept.size(), b.kept.size());
  for (std::size_t v = 0; v < a.kept.size(); ++v) EXPECT_EQ(b.kept[v], a.kept[v] == kNone ? kNone : a.kept[v] + 2);
  ASSERT_EQ(b.welded.vertex_of.size(), other.vertices.size());
  EXPECT_EQ(b.welded.vertex_of[1], kNone);
  EXPECT_EQ(b.welded.vertex_of[2], a.welded.vertex_of[0]);
}

TEST(RemeshThin, APlateKeepsItsTwoSides) {
  TriangleMesh plate = box(8);
  for (Vec3& v : plate.vertices) v.z *= 0.02;
  const RemeshResult result = remesh(plate, options_for(1000));
  EXPECT_EQ(result.mesh.vertices.size(), 1000u);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.topology.euler, 2);
  EXPECT_TRUE(result.topology.manifold && result.topology.closed);
  EXPECT_EQ(result.untiled, 0u);
}

// The sides of a plate have the first edges of both curves at a corner in common: a triangle of these, and the third
// edge, would be the same on both. One side gets a vertex there, and no curve is halved ever again.
TEST(RemeshThin, AnAngularPlateHasGoodTrianglesAtItsCorners) {
  const std::vector<std::array<double, 2>> outline{{0, 0},     {3, 0},     {3, 1},     {1.7, 1}, {1.7, 2.1},
                                                   {1.1, 2.1}, {1.1, 1.4}, {0.4, 1.6}, {0.4, 1}, {0, 1}};
  const std::vector<std::array<Index, 3>> faces{{0, 1, 2}, {0, 2, 3}, {0, 3, 8}, {0, 8, 9},
                                                {3, 4, 6}, {4, 5, 6}, {3, 6, 8}, {6, 7, 8}};
  const auto count = static_cast<Index>(outline.size());
  TriangleMesh plate;
  for (const double z : {0.0, 0.002})
    for (const auto& [x, y] : outline) plate.vertices.push_back({x, y, z});
  for (const auto& [a, b, c] : faces) {
    plate.triangles.push_back({a, c, b});
    plate.triangles.push_back({count + a, count + b, count + c});
  }
  for (Index v = 0; v < count; ++v) {
    const Index next = (v + 1) % count;
    plate.triangles.push_back({v, next, count + next});
    plate.triangles.push_back({v, count + next, count + v});
  }
  ASSERT_TRUE(topology_of(plate).manifold && topology_of(plate).closed && topology_of(plate).oriented);
  for (const std::size_t vertices : {150, 300}) {
    const RemeshResult result = remesh(plate, options_for(vertices));
    EXPECT_TRUE(result.topology_matches);
    EXPECT_EQ(result.features.broken, 0u);
    EXPECT_LE(result.mesh.vertices.size(), vertices + vertices / 50);
    EXPECT_GE(measure_quality(result.mesh).theta_min, 30) << vertices;
  }
}

// A hollow ball whose wall is a tenth of the edges: each side is meshed as if the other were not there.
// There a seed that is put beside the corner, as far from it as the first seeds of its curves, is too far away to own
// the places where cells of both sides meet.
TEST(RemeshThin, APlateWithABevelledCornerKeepsItsTopology) {
  const std::vector<std::array<double, 2>> outline = {{0, 3.525}, {1.575, 1.95}, {4.675, 1.95}, {4.675, 8},
                                                      {6.2, 8},   {6.2, 20},     {0, 20}};
  const auto count = static_cast<Index>(outline.size());
  TriangleMesh plate;
  for (const double y : {0.0, 0.1})
    for (const auto& [x, z] : outline) plate.vertices.push_back({x, y, z});
  for (Index k = 0; k < count; ++k) {
    const Index next = (k + 1) % count;
    plate.triangles.push_back({k, next, count + next});
    plate.triangles.push_back({k, count + next, count + k});
  }
  for (Index k = 1; k + 1 < count; ++k) {
    plate.triangles.push_back({0, k + 1, k});
    plate.triangles.push_back({count, count + k, count + k + 1});
  }
  for (const std::size_t vertices : {16, 20, 24, 28}) {
    RemeshOptions options;
    options.vertices = vertices;
    const RemeshResult result = remesh(plate, options);
    EXPECT_TRUE(result.topology_matches) << vertices;
    EXPECT_EQ(result.features.broken, 0u) << vertices;
  }
}

TEST(RemeshThin, AShellHasGoodTrianglesOnBothSides) {
  TriangleMesh shell = icosphere(3);
  TriangleMesh inside = shell;
  for (Vec3& v : inside.vertices) v = 0.98 * v;
  const auto first = static_cast<Index>(shell.vertices.size());
  shell.vertices.insert(shell.vertices.end(), inside.vertices.begin(), inside.vertices.end());
  for (const Triangle& t : inside.triangles) shell.triangles.push_back({t[0] + first, t[2] + first, t[1] + first});
  const RemeshResult result = remesh(shell, options_for(400));
  EXPECT_TRUE(result.topology_matches);
  EXPECT_TRUE(result.ball_property);
  EXPECT_EQ(result.untiled, 0u);
  EXPECT_GT(measure_quality(result.mesh).theta_min, 35);
  for (const Vec3& p : result.mesh.vertices) EXPECT_TRUE(norm(p) > 0.99 || norm(p) < 0.981) << norm(p);
}

// The middle of a cell of both sides of a pipe is nearer to the inner side, where too many seeds come to lie so.
TEST(RemeshThin, APipeHasAsGoodTrianglesOutsideAsInside) {
  constexpr Index kCount = 96;
  TriangleMesh pipe;
  for (const auto& [radius, z] : {std::array{1.0, 0.0}, {1.0, 1.0}, {0.99, 1.0}, {0.99, 0.0}})
    for (Index k = 0; k < kCount; ++k) {
      const double angle = 2 * std::numbers::pi * k / kCount;
      pipe.vertices.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
    }
  for (Index side = 0; side < 4; ++side)
    for (Index k = 0; k < kCount; ++k) {
      const Index a = side * kCount + k, b = side * kCount + (k + 1) % kCount, up = (side + 1) % 4 * kCount;
      pipe.triangles.push_back({a, b, up + (k + 1) % kCount});
      pipe.triangles.push_back({a, up + (k + 1) % kCount, up + k});
    }
  for (const std::size_t vertices : {250, 300}) {
    const RemeshResult result = remesh(pipe, options_for(vertices));
    EXPECT_TRUE(result.topology_matches);
    EXPECT_LE(result.mesh.vertices.size(), vertices + vertices / 100);
    EXPECT_GE(measure_quality(result.mesh).theta_min, 30) << vertices;
  }
}

// Whatever the dual is, it is reported for what it is.
TEST(RemeshHard, NonManifoldInputRunsAndReports) {
  const std::vector<Case> hard{{"pages", pages(), 300, false},
                               {"soup", soup(10, 5), 150, false},
                               {"duplicated", duplicated_triangles(), 100, false},
                               {"needles", needles(), 100, false},
                               {"collinear", collinear_among_good(), 100, false}};
  for (const auto& [name, mesh, vertices, smooth] : hard)
    for (TopologyControl control : {TopologyControl::enforce, TopologyControl::check}) {
      SCOPED_TRACE(name);
      RemeshOptions options = options_for(vertices);
      options.topology = control;
      options.iterations = 30;
      const RemeshResult result = remesh(mesh, options);
      EXPECT_EQ(result.untiled, 0u);
      EXPECT_FALSE(result.mesh.triangles.empty());
      // More only where that mends the topology or keeps features.
      EXPECT_TRUE(result.mesh.vertices.size() <= vertices || result.topology_matches || result.features.curves > 0);
      const MeshTopology topology = analyse_topology(result.mesh.triangles, result.mesh.vertices.size());
      EXPECT_EQ(result.topology.manifold, topology.manifold);
      EXPECT_EQ(result.topology.euler, topology.euler);
      const MeshTopology input = topology_of(remove_double_triangles(mesh).mesh);
      EXPECT_EQ(result.topology_matches, topology.manifold == input.manifold && topology.oriented == input.oriented &&
                                             topology.closed == input.closed && topology.euler == input.euler &&
                                             topology.components == input.components);
    }
}

// A thin limb beside three sheets that share an edge: what mends it on a manifold does so here.
TEST(RemeshHard, TopologyIsMendedBesideEdgesOfThreeSheets) {
  TriangleMesh limb = icosphere(4);
  for (Vec3& p : limb.vertices) p = {p.x, 0.03 * p.y, 0.03 * p.z};
  const TriangleMesh mesh = joined(pages(), limb, {0, 10, 0});
  for (const std::size_t vertices : {60, 100}) {
    SCOPED_TRACE(vertices);
    RemeshOptions options = options_for(vertices);
    options.topology = TopologyControl::check;
    EXPECT_FALSE(remesh(mesh, options).topology_matches);
    options.topology = TopologyControl::enforce;
    EXPECT_TRUE(remesh(mesh, options).topology_matches);
  }
}

// Boxes that touch in a corner are remeshed as two, both with that corner.
TEST(RemeshHard, WhatTouchesInAPointIsSeveralSurfaces) {
  const TriangleMesh one = box(4);
  const auto index_of = [](const std::vector<Vec3>& points, const Vec3& p) {
    return static_cast<Index>(std::find(points.begin(), points.end(), p) - points.begin());
  };
  TriangleMesh boxes = one;
  for (Triangle t : one.triangles) {
    for (Index& v : t) {
      const Vec3 p = one.vertices[v] + Vec3{1, 1, 1};
      v = index_of(boxes.vertices, p);
      if (v == boxes.vertices.size()) boxes.vertices.push_back(p);
    }
    boxes.triangles.push_back(t);
  }
  ASSERT_EQ(analyse_topology(boxes.triangles, boxes.vertices.size()).non_manifold_vertices, 1u);
  std::vector<std::string> warnings;
  Context context;
  context.warning = [&](const std::string& line) { warnings.push_back(line); };
  const RemeshResult result = remesh(boxes, options_for(800), context);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_TRUE(result.topology.manifold && result.topology.closed && result.topology_matches);
  EXPECT_EQ(result.topology.components, 2u);
  EXPECT_EQ(result.mesh.vertices.size(), 800u);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_GT(measure_quality(result.mesh).theta_min, 30);
  const auto is_there = [](const Vec3& v) { return norm(v - Vec3{1, 1, 1}) < 1e-6; };
  EXPECT_EQ(std::count_if(result.mesh.vertices.begin(), result.mesh.vertices.end(), is_there), 2);
}

// Two borders of a plate that have a vertex each at the same point, as files leave it that were made manifold: of two
// seeds there one would own nothing.
TEST(RemeshHard, BordersThatTouchInAPointKeepTheirCurves) {
  const int cells = 3;
  TriangleMesh plate;
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x) plate.vertices.push_back({double(x), double(y), 0});
  const auto at = [&](int x, int y) { return static_cast<Index>(y * (cells + 1) + x); };
  for (int y = 0; y < cells; ++y)
    for (int x = 0; x < cells; ++x) {
      if ((x == 0 && y == 0) || (x == 1 && y == 1)) continue;
      plate.triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      plate.triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  const auto copy = static_cast<Index>(plate.vertices.size());
  plate.vertices.push_back({1, 1, 0});
  for (Triangle& t : plate.triangles)
    if (std::find(t.begin(), t.end(), at(1, 0)) != t.end()) std::replace(t.begin(), t.end(), at(1, 1), copy);
  ASSERT_TRUE(analyse_topology(plate.triangles, plate.vertices.size()).manifold);
  const RemeshResult result = remesh(plate, options_for(600));
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_EQ(result.mesh.vertices.size(), 600u);
  EXPECT_GT(measure_quality(result.mesh).theta_min, 30);
}

// A tip that touches a straight border of another part: an edge of that part across the point would cross the tip where
// the border bends, so the border has a corner there.
TEST(RemeshHard, ABorderHasACornerWhereATipTouchesIt) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {1, 0, 0}, {0.4, -1, 0}, {1.6, -1, 0}};
  mesh.triangles = {{0, 1, 4}, {1, 2, 3}, {1, 3, 4}, {5, 6, 7}};
  const RemeshResult result = remesh(mesh, options_for(300));
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.features.broken, 0u);
  const auto is_there = [](const Vec3& v) { return norm(v - Vec3{1, 0, 0}) < 1e-5; };
  EXPECT_EQ(std::count_if(result.mesh.vertices.begin(), result.mesh.vertices.end(), is_there), 2);
}

TEST(RemeshHard, FewVerticesGiveWhatTheyCan) {
  for (const TriangleMesh& mesh : {icosphere(3), torus(24, 16), box(2), two_spheres()})
    for (std::size_t vertices : {4u, 5u, 12u, 40u}) {
      RemeshOptions options = options_for(vertices);
      const RemeshResult enforced = remesh(mesh, options);
      EXPECT_EQ(enforced.untiled, 0u);
      // Seeds are only added for the sake of the topology.
      EXPECT_TRUE(enforced.mesh.vertices.size() <= vertices || enforced.topology_matches);
      options.topology = TopologyControl::check;
      const RemeshResult checked = remesh(mesh, options);
      EXPECT_EQ(checked.untiled, 0u);
      // Corners are vertices however few were asked for; of the box's eight some may have been merged.
      EXPECT_LE(checked.mesh.vertices.size(), std::max(vertices, detect_features(mesh).corners.size()));
    }
  const RemeshResult tetrahedron = remesh(icosphere(3), options_for(4));
  EXPECT_TRUE(tetrahedron.topology_matches);
  EXPECT_EQ(tetrahedron.mesh.triangles.size(), 4u);
}

TEST(RemeshHard, ThereIsNothingToFitWithoutTriangles) {
  RemeshOptions options = options_for(4);
  options.fit = true;
  options.topology = TopologyControl::check;
  const RemeshResult result = remesh(torus(24, 16), options);
  EXPECT_TRUE(result.mesh.triangles.empty());
}

// Else the sheets of the result cross in more pairs than those of the input. The open one lacks triangles where nothing
// crosses.
TEST(RemeshHard, ASurfaceThatGoesThroughItselfHasPartsThatTouch) {
  for (const bool open : {false, true}) {
    TriangleMesh input = figure_of_eight(12, 9);
    if (open) input.triangles.resize(input.triangles.size() - 4);
    const std::size_t before = count_self_intersections(input);
    ASSERT_GT(before, 0u);
    std::vector<std::string> warnings;
    Context context;
    context.warning = [&](const std::string& line) { warnings.push_back(line); };
    RemeshOptions options;
    options.vertices = 1500;
    const RemeshResult result = remesh(input, options, context);
    EXPECT_LE(count_self_intersections(result.mesh), before);
    EXPECT_TRUE(result.topology_matches);
    EXPECT_EQ(result.topology.components, 2u);
    EXPECT_EQ(result.features.broken, 0u);
    EXPECT_EQ(std::count_if(warnings.begin(), warnings.end(),
                            [](const std::string& line) { return line.find("goes through itself") != line.npos; }),
              1);
    ASSERT_EQ(result.welded.vertex_of.size(), input.vertices.size());
  }
}

TEST(RemeshOptionsTest, GivenSeedsAreTheStart) {
  const TriangleMesh mesh = icosphere(3);
  RemeshOptions options;
  options.seeds = random_seeds(mesh, 200, 6);
  options.iterations = 0;
  options.energy = Energy::restricted;
  options.topology = TopologyControl::off;
  const RemeshResult start = remesh(mesh, options);
  EXPECT_EQ(start.iterations, 0);
  EXPECT_TRUE(same_bits(start.mesh.vertices, options.seeds));
  options.iterations = 50;
  const RemeshResult free = remesh(mesh, options);
  EXPECT_LT(free.energy, start.energy);
  options.energy = Energy::constrained;
  const RemeshResult constrained = remesh(mesh, options);
  // The free minimum leaves the surface, and lies below.
  EXPECT_LT(free.energy, constrained.energy);
  for (const Vec3& x : constrained.mesh.vertices) EXPECT_LE(distance_to(mesh, x), 1e-11);
}

// A goal that not all triangles reach.
TEST(RemeshOptionsTest, FittingMakesNoTriangleWorseThatMissesTheGoal) {
  const TriangleMesh mesh = icosphere(4);
  RemeshOptions options = options_for(300);
  options.iterations = 5;
  options.min_angle = 50;
  const RemeshResult before = remesh(mesh, options);
  options.fit = true;
  const RemeshResult after = remesh(mesh, options);
  ASSERT_EQ(after.mesh.triangles, before.mesh.triangles);
  EXPECT_GT(after.fitted.iterations, 0);
  const auto smallest = [](const TriangleMesh& of, const Triangle& t) {
    TriangleMesh one;
    for (const Index v : t) one.vertices.push_back(of.vertices[v]);
    one.triangles = {{0, 1, 2}};
    return measure_quality(one).theta_min;
  };
  std::size_t missing = 0;
  for (const Triangle& t : before.mesh.triangles) {
    const double was = smallest(before.mesh, t);
    missing += was < options.min_angle;
    EXPECT_GE(smallest(after.mesh, t), std::min(was, options.min_angle) - 1e-6);
  }
  EXPECT_GT(missing, 10u);
}

TEST(RemeshOptionsTest, EveryNumberOfLevelsGivesTheCount) {
  const TriangleMesh mesh = torus(60, 36);
  for (int levels : {1, 2, 3, 4}) {
    RemeshOptions options = options_for(777);
    options.levels = levels;
    options.iterations = 30;
    EXPECT_EQ(remesh(mesh, options).mesh.vertices.size(), 777u) << levels;
  }
}

TEST(RemeshOptionsTest, ProgressRunsForwardAndCancelStops) {
  const TriangleMesh mesh = icosphere(4);
  std::atomic<bool> cancel{false};
  double fraction = 0;
  int reports = 0;
  Context context;
  context.cancel = &cancel;
  context.progress = [&](const Progress& p) {
    EXPECT_GE(p.fraction, fraction);
    EXPECT_LE(p.fraction, 1);
    EXPECT_FALSE(p.phase.empty());
    fraction = p.fraction;
    ++reports;
  };
  remesh(mesh, options_for(500), context);
  EXPECT_GT(reports, 10);
  EXPECT_GT(fraction, 0.3);
  reports = 0;
  context.progress = [&](const Progress&) { cancel = ++reports == 5; };
  EXPECT_THROW(remesh(mesh, options_for(500), context), Cancelled);
  EXPECT_EQ(reports, 5);
}

// The tip of a pyramid just misses an edge of a cube.
TEST(RemeshHard, ATipThatNearlyTouchesAnEdgeMakesNoSlivers) {
  TriangleMesh mesh = box(1);
  const auto tip = static_cast<Index>(mesh.vertices.size());
  const Vec3 p{1.002, -0.002, 0.5};
  mesh.vertices.push_back(p);
  for (const auto& [across, up] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}})
    mesh.vertices.push_back(p + Vec3{0.64 + 0.42 * across, -0.64 + 0.42 * across, 0.6 * up});
  for (Index k = 1; k <= 4; ++k) mesh.triangles.push_back({tip, tip + k, tip + k % 4 + 1});
  mesh.triangles.push_back({tip + 1, tip + 3, tip + 2});
  mesh.triangles.push_back({tip + 1, tip + 4, tip + 3});
  const RemeshResult result = remesh(mesh, options_for(400));
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.features.curves, 20u);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_GT(measure_quality(result.mesh).theta_min, 30);
}

// Files hold triangles twice, in either order of their corners: that is one sheet.
TEST(RemeshHard, RepeatedTrianglesAreTakenOnce) {
  TriangleMesh mesh = box(2);
  const MeshTopology once = analyse_topology(mesh.triangles, mesh.vertices.size());
  for (std::size_t t = 0; t < 6; ++t) {
    const Triangle v = mesh.triangles[t];
    mesh.triangles.push_back(t % 2 ? v : Triangle{v[1], v[0], v[2]});
  }
  const RemeshResult result = remesh(mesh, options_for(300));
  EXPECT_TRUE(same_topology(result.input_topology, once));
  EXPECT_TRUE(result.topology_matches);
  EXPECT_GT(measure_quality(result.mesh).theta_min, 30);
}

// A curve in a plane ends just beside another one: a seed for each would be slivers.
TEST(RemeshHard, ACurveThatPassesACornerGoesThroughIt) {
  for (const double gap : {0.003, 0.02}) {
    SCOPED_TRACE(gap);
    TriangleMesh mesh;
    mesh.vertices = {{-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0}, {-2, 0, 0}, {2, 0, 0}, {0, gap, 0}, {0, 2, 0}};
    mesh.triangles = {{0, 1, 5}, {0, 5, 4}, {0, 4, 3}, {1, 2, 5}, {4, 5, 6},
                      {6, 5, 7}, {5, 2, 7}, {7, 2, 3}, {4, 6, 7}, {4, 7, 3}};
    RemeshOptions options = options_for(200);
    options.features.given = {{4, 5}, {6, 7}};
    options.detail = DetailMode::off;
    const RemeshResult result = remesh(mesh, options);
    EXPECT_EQ(result.features.curves, 6u);
    EXPECT_EQ(result.features.broken, 0u);
    EXPECT_EQ(result.mesh.vertices.size(), 200u);
    EXPECT_GT(measure_quality(result.mesh).theta_min, 35);
  }
}

// A needle-like cone: the tip is a corner, but its cell must not be wrapped by two others.
TEST(RemeshHard, AThinTipKeepsTheTopology) {
  TriangleMesh cone;
  const Index sides = 32;
  for (Index k = 0; k < sides; ++k) {
    const double t = 2 * 3.141592653589793 * k / sides;
    cone.vertices.push_back({std::cos(t), std::sin(t), 0});
    cone.triangles.push_back({k, (k + 1) % sides, sides});
    cone.triangles.push_back({(k + 1) % sides, k, sides + 1});
  }
  cone.vertices.push_back({0, 0, 20});
  cone.vertices.push_back({0, 0, 0});
  const RemeshResult result = remesh(cone, options_for(250));
  EXPECT_TRUE(result.topology_matches);
  EXPECT_TRUE(result.ball_property);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_EQ(result.features.curves, 1u);
}

// So few vertices for a cube with engraved letters leave slivers in the first result.
TEST(RemeshHard, ARunAgainMovesSeedsAroundWhatItMends) {
  const TriangleMesh mesh = read_mesh(BISECTOR_SOURCE_DIR "/examples/engraved.off");
  std::vector<std::string> phases;
  Context context;
  context.progress = [&](const Progress& p) { phases.push_back(p.phase); };
  RemeshOptions options = options_for(132);
  const RemeshResult result = remesh(mesh, options, context);
  const auto mentions = [](const char* words) {
    return [words](const std::string& phase) { return phase.find(words) != std::string::npos; };
  };
  EXPECT_TRUE(std::any_of(phases.begin(), phases.end(), mentions("around shorter edges")));
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_EQ(result.untiled, 0u);
  EXPECT_FALSE(find_slivers(result.mesh).worth_another_run);
  EXPECT_EQ(count_self_intersections(result.mesh), 0u);
  options.threads = 1;
  EXPECT_TRUE(same_mesh(remesh(mesh, options).mesh, result.mesh));
}

// Bounds that hold for samples and for the known distance of a chord.
TEST(RemeshDistance, IsBroughtDownToWhatIsAskedFor) {
  const TriangleMesh ball = icosphere(4);
  RemeshOptions options = options_for(60);
  options.distance_max = 0.02;
  const RemeshResult result = remesh(ball, options);
  EXPECT_LE(result.distance.upper, options.distance_max);
  EXPECT_LE(result.distance.lower, result.distance.upper);
  EXPECT_GT(result.distance.runs, 0);
  EXPECT_EQ(result.distance.most_vertices, 600u);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.mesh.vertices.size(), result.wanted);
  const double diagonal = bounding_box(ball.vertices).diagonal();
  const double sampled = measure_distance(result.mesh, ball).max / 100 * diagonal;
  EXPECT_GE(result.distance.upper, sampled);
  EXPECT_LE(result.distance.lower, sampled + 0.02 * options.distance_max + 1e-6);
  // Enough vertices for it: the middle of an equilateral triangle lies h^2 / 6 below the sphere.
  const double h = std::sqrt(4 * std::numbers::pi / (std::numbers::sqrt3 / 2 * static_cast<double>(result.wanted)));
  EXPECT_LT(h * h / 6, options.distance_max);
}

TEST(RemeshDistance, EndsWithTheMostVerticesThatMayBeAskedFor) {
  RemeshOptions options = options_for(60);
  options.distance_max = 1e-4;
  options.most_vertices = 90;
  const RemeshResult result = remesh(icosphere(4), options);
  EXPECT_EQ(result.wanted, 90u);
  EXPECT_GT(result.distance.upper, options.distance_max);
  EXPECT_EQ(result.distance.most_vertices, 90u);
  EXPECT_LT(result.distance.upper, 0.1);
}

TEST(RemeshDistance, IsLeftWhereItIsKeptAlready) {
  RemeshOptions options = options_for(200);
  const RemeshResult plain = remesh(icosphere(4), options);
  options.distance_max = 0.5;
  const RemeshResult result = remesh(icosphere(4), options);
  EXPECT_EQ(result.distance.runs, 0);
  EXPECT_EQ(result.mesh.vertices, plain.mesh.vertices);
  EXPECT_EQ(plain.distance.upper, 0);
  EXPECT_LE(result.distance.upper, 0.5);
}

TEST(RemeshErrors, AreOneLineThatSaysWhatToDo) {
  const auto message = [](const TriangleMesh& mesh, const RemeshOptions& options) {
    try {
      remesh(mesh, options);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_NE(message(icosphere(1), options_for(0)).find("vertices"), std::string::npos);
  TriangleMesh far = icosphere(1);
  far.vertices[3].y = 1e41;
  EXPECT_NE(message(far, options_for(100)).find("vertex 3: a coordinate is beyond 1e+40"), std::string::npos);
  far.vertices[3].y = std::nan("");
  EXPECT_NE(message(far, options_for(100)).find("vertex 3: a coordinate is not finite"), std::string::npos);
  TriangleMesh tiny = icosphere(1);
  for (Vec3& p : tiny.vertices) p = 1e-41 * p;
  EXPECT_NE(message(tiny, options_for(100)).find("no vertex has a coordinate of 1e-40 or more"), std::string::npos);
  for (std::size_t vertices : {1u, 3u})
    EXPECT_NE(message(icosphere(1), options_for(vertices)).find("4"), std::string::npos);
  RemeshOptions seeded;
  seeded.seeds = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
  EXPECT_FALSE(message(icosphere(1), seeded).empty());
  seeded.seeds.push_back({0, 0, -1});
  seeded.distance_max = 0.1;
  EXPECT_NE(message(icosphere(1), seeded).find("distance"), std::string::npos);
  RemeshOptions negative = options_for(10);
  negative.distance_max = -1;
  EXPECT_NE(message(icosphere(1), negative).find("distance"), std::string::npos);
  const TriangleMesh line{{{0, 0, 0}, {1, 1, 1}, {3, 3, 3}}, {{0, 1, 2}, {2, 1, 0}}, {}};
  for (const TriangleMesh& mesh : {TriangleMesh{}, line}) {
    const std::string text = message(mesh, options_for(10));
    EXPECT_FALSE(text.empty());
    EXPECT_EQ(text.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace bisector::test
