// The quality pass: its model of the dual against the dual itself, and what it may and may not do to a mesh.
#include "remesh/improve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "backend/cpu_backend.h"
#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "mesh/topology.h"
#include "remesh/feature_recovery.h"
#include "remesh/improve_patch.h"
#include "remesh/topology_control.h"
#include "support/diagram.h"
#include "support/models.h"
#include "support/optimised.h"

namespace bisector::test {
namespace {

using Kind = SeedPlace::Kind;

// --- The cost of a triangle ---

const ShapeGoal kGoal = shape_goal(40, 91);

// Isosceles with an apex of so many degrees.
std::array<Vec3, 3> isosceles(double apex) {
  const double half = apex / 2 * std::numbers::pi / 180;
  return {Vec3{0, 0, 0}, Vec3{std::sin(half), std::cos(half), 0}, Vec3{-std::sin(half), std::cos(half), 0}};
}

TEST(ShapeCost, IsZeroForEquilateralTrianglesAndGrowsAwayFromThem) {
  const auto cost = [](double apex) {
    const auto [a, b, c] = isosceles(apex);
    return shape_cost(a, b, c, kGoal);
  };
  EXPECT_NEAR(cost(60), 0, 1e-12);
  for (double apex = 60; apex < 175; apex += 1) EXPECT_LT(cost(apex), cost(apex + 1)) << apex;
  for (double apex = 60; apex > 2; apex -= 1) EXPECT_LT(cost(apex), cost(apex - 1)) << apex;
}

TEST(ShapeCost, DependsOnShapeAlone) {
  SplitMix64 random(3);
  for (int trial = 0; trial < 100; ++trial) {
    Vec3 p[3];
    for (Vec3& x : p) x = {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    const double cost = shape_cost(p[0], p[1], p[2], kGoal);
    const Vec3 shift{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    Vec3 q[3];
    for (int k = 0; k < 3; ++k) q[k] = 7.5 * Vec3{p[k].y, p[k].z, p[k].x} + shift;
    EXPECT_NEAR(shape_cost(q[1], q[2], q[0], kGoal), cost, 1e-9 * cost);
    EXPECT_NEAR(shape_cost(q[1], q[0], q[2], kGoal), cost, 1e-9 * cost);
  }
}

TEST(ShapeExcess, IsTheAnglesBeyondTheGoal) {
  for (double apex = 5; apex < 170; apex += 5) {
    const auto [a, b, c] = isosceles(apex);
    const ShapeExcess excess = shape_excess(a, b, c, kGoal);
    const double base = (180 - apex) / 2;
    EXPECT_NEAR(excess.under, std::max(0.0, 40 - std::min(apex, base)), 1e-6);
    EXPECT_NEAR(excess.over, std::max(0.0, std::max(apex, base) - 91), 1e-6);
  }
}

TEST(ShapeExcess, IsImposedBetweenLockedEdges) {
  // The smallest angle is at corner 0, 1 or 2, between edges 0 and 2, 0 and 1 or 1 and 2.
  const Vec3 smallest{0, 0, 0}, middle{3, 0, 0}, largest{2.5, 1, 0};
  const std::array<std::array<Vec3, 3>, 3> triangles{
      {{smallest, middle, largest}, {largest, smallest, middle}, {middle, largest, smallest}}};
  for (int at = 0; at < 3; ++at)
    for (int locked = 0; locked < 8; ++locked) {
      const std::array<bool, 3> edges{(locked & 1) != 0, (locked & 2) != 0, (locked & 4) != 0};
      EXPECT_EQ(angle_is_imposed(triangles[at], edges), edges[at] && edges[(at + 2) % 3]) << at << ' ' << locked;
    }
}

// What angle_is_imposed says of the smallest angle alone, this says of each.
TEST(FreeAngleLack, IsOfAnglesThatAreNotBetweenLockedEdges) {
  const std::array<Vec3, 3> triangle{Vec3{0, 0, 0}, Vec3{3, 0, 0}, Vec3{2.5, 1, 0}};
  const double at_first = std::atan2(1, 2.5) * 180 / std::numbers::pi;
  const double at_second = std::atan2(1, 0.5) * 180 / std::numbers::pi, third = 180 - at_first - at_second;
  for (const double degrees : {20.0, 30.0, 70.0, 100.0}) {
    const auto lack = [&](std::initializer_list<double> angles) {
      double most = 0;
      for (const double angle : angles) most = std::max(most, degrees - angle);
      return most;
    };
    EXPECT_NEAR(free_angle_lack(triangle, {false, false, false}, degrees), lack({at_first, at_second, third}), 1e-9);
    EXPECT_NEAR(free_angle_lack(triangle, {true, false, false}, degrees), lack({at_first, at_second, third}), 1e-9);
    EXPECT_NEAR(free_angle_lack(triangle, {true, false, true}, degrees), lack({at_second, third}), 1e-9);
    EXPECT_NEAR(free_angle_lack(triangle, {true, true, false}, degrees), lack({at_first, third}), 1e-9);
    EXPECT_EQ(free_angle_lack(triangle, {true, true, true}, degrees), 0);
  }
}

// --- The patch ---

// The whole dual of seeds on a surface as a patch.
struct WholePatch {
  explicit WholePatch(TriangleMesh mesh, std::vector<Vec3> given)
      : surface(std::move(mesh)), seeds(std::move(given)),
        diagram(diagram_of(surface, seeds, NeighbourSource::nearest)), dual(extract_dual(diagram.polygons)),
        rings(vertex_neighbours(dual.triangles, seeds.size())), map(surface, seeds, diagram.moments.triangles, rings),
        patch(map, nullptr, kGoal) {
    for (Index v = 0; v < seeds.size(); ++v) {
      PatchVertex vertex;
      vertex.x = seeds[v];
      vertex.owner = vertex.seed = v;
      vertex.free = true;
      map.project(vertex.x, vertex.owner, vertex.normal);
      patch.add_vertex(vertex);
    }
    for (const Triangle& t : dual.triangles) patch.add_triangle(t);
  }

  Surface surface;
  std::vector<Vec3> seeds;
  Diagram diagram;
  Dual dual;
  Csr<Index> rings;
  CellMap map;
  ImprovePatch patch;
};

std::vector<Triangle> normalised(std::vector<Triangle> triangles) {
  for (Triangle& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

// In the plane the dual is a part of the Delaunay triangulation, and flips lead back to it from anywhere.
TEST(ImprovePatch, FlipsLeadBackToTheDualInThePlane) {
  for (std::uint64_t random_seed : {1u, 2u, 3u}) {
    WholePatch whole(grid_patch(4, 4), random_seeds(grid_patch(4, 4), 120, random_seed));
    ImprovePatch& patch = whole.patch;
    const std::vector<Triangle> dual = normalised(whole.dual.triangles);
    EXPECT_EQ(normalised(patch.triangles()), dual);
    patch.make_delaunay();
    EXPECT_EQ(normalised(patch.triangles()), dual);
    SplitMix64 random(random_seed);
    std::size_t flips = 0;
    for (int trial = 0; trial < 400; ++trial) {
      const std::vector<Triangle> triangles = patch.triangles();
      const Triangle& t = triangles[random.below(triangles.size())];
      flips += patch.flip(t[0], t[1]);
    }
    EXPECT_GT(flips, 50u);
    EXPECT_NE(normalised(patch.triangles()), dual);
    for (int k = 0; k < 20; ++k) patch.make_delaunay();
    EXPECT_EQ(normalised(patch.triangles()), dual);
  }
}

TEST(ImprovePatch, LockedEdgesStay) {
  WholePatch whole(grid_patch(4, 4), random_seeds(grid_patch(4, 4), 120, 4));
  const Triangle& t = whole.dual.triangles[100];
  whole.patch.lock({{std::min(t[0], t[1]), std::max(t[0], t[1])}});
  EXPECT_FALSE(whole.patch.flip(t[0], t[1]));
}

// On a straight curve, seeds in the balls around its links have cells that cut it, or are behind such a cell.
TEST(ImprovePatch, EncroachmentsTellOfCellsThatCutTheCurve) {
  const TriangleMesh mesh = grid_patch(4, 4);
  const Box box = bounding_box(mesh.vertices);
  FeatureGraph graph;
  graph.corners = {0, 4};
  for (Index v = 0; v < 4; ++v) graph.edges.push_back({v, v + 1});
  graph.curves = {{{0, 1, 2, 3, 4}, false}};
  const Surface surface(mesh);
  const FeatureCurves curves(graph, mesh.vertices);
  ASSERT_EQ(curves.size(), 1u);
  const FeatureTrace trace(surface, curves);
  int broken = 0, whole = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    SplitMix64 random(seed);
    PlacedSeeds seeds;
    for (const Index corner : {0, 1}) seeds.add(curves.corner(corner), {Kind::fixed, kNone, corner, 0});
    const Index links = 5;
    for (Index k = 1; k < links; ++k) {
      const double position = curves.length(0) * k / links;
      seeds.add(curves.point(0, position), {Kind::curve, 0, kNone, position});
    }
    for (int k = 0; k < 12; ++k) {
      Vec3 x = box.lo;
      for (int m = 0; m < 3; ++m) x[m] += random.unit() * (box.hi[m] - box.lo[m]);
      seeds.add(x, {});
    }
    const Diagram diagram = diagram_of(surface, seeds.positions(), NeighbourSource::nearest);
    const Csr<Index> rings = vertex_neighbours(diagram.dual.triangles, seeds.size());
    const CellMap map(surface, seeds.positions(), diagram.moments.triangles, rings);
    ImprovePatch patch(map, &curves, kGoal);
    for (Index v = 0; v < seeds.size(); ++v) {
      PatchVertex vertex;
      vertex.x = seeds.position(v);
      vertex.place = seeds.place(v);
      vertex.owner = vertex.seed = v;
      patch.add_vertex(vertex);
    }
    std::vector<LockedEdge> chain;
    for (Index k = 0; k < links; ++k) {
      const Index a = k == 0 ? 0 : k + 1, b = k + 1 == links ? 1 : k + 2;
      chain.push_back({std::min(a, b), std::max(a, b), 0});
    }
    patch.lock(chain);
    std::size_t strangers = 0;
    const std::vector<CurveInterval> intervals = trace.trace(diagram.polygons)[0];
    for (const CurveInterval& i : intervals) strangers += seeds.on_surface(i.cell);
    EXPECT_GE(patch.encroachments(), strangers) << seed;
    EXPECT_EQ(patch.encroachments() > 0, strangers > 0) << seed;
    ++(strangers > 0 ? broken : whole);
  }
  EXPECT_GT(broken, 10);
  EXPECT_GT(whole, 10);
}

TEST(ImprovePatch, OperationsKeepASphereASphere) {
  WholePatch whole(icosphere(4), random_seeds(icosphere(4), 150, 5));
  ImprovePatch& patch = whole.patch;
  SplitMix64 random(6);
  long long vertices = 150;
  int removed = 0, added = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const std::vector<Triangle> triangles = patch.triangles();
    const std::size_t k = random.below(triangles.size());
    const auto [a, b, c] = triangles[k];
    switch (random.below(4)) {
      case 0: removed += patch.remove(a); break;
      case 1: added += patch.split(a, b); break;
      case 2: added += patch.insert(patch.largest_triangle(a)); break;
      default: patch.flip(b, c);
    }
    const MeshTopology topology = analyse_topology(patch.triangles(), patch.vertices().size());
    ASSERT_TRUE(topology.manifold && topology.closed && topology.oriented);
    ASSERT_EQ(topology.euler, 2);
    ASSERT_EQ(patch.triangles().size(), 2 * static_cast<std::size_t>(vertices + added - removed) - 4);
  }
  EXPECT_GT(removed, 20);
  EXPECT_GT(added, 20);
}

TEST(ImprovePatch, RelaxingNeverCostsAndStaysOnTheSurface) {
  WholePatch whole(icosphere(4), random_seeds(icosphere(4), 150, 7));
  ImprovePatch& patch = whole.patch;
  double cost = patch.cost(0, 0);
  const double first = cost;
  for (int sweep = 0; sweep < 5; ++sweep)
    for (Index v = 0; v < patch.vertices().size(); ++v) {
      const bool moved = patch.relax(v, 0);
      const double next = patch.cost(0, 0);
      EXPECT_EQ(moved, next < cost);
      cost = next;
    }
  EXPECT_LT(cost, 0.5 * first);
  for (const PatchVertex& vertex : patch.vertices())
    EXPECT_LT(norm2(nearest_of_all(whole.surface, vertex.x) - vertex.x), 1e-28);
}

// A seed that is held stays nearer to where it was, the more so the more it is held.
TEST(ImprovePatch, HoldingLimitsTheWay) {
  double last = 1e9;
  for (const double hold : {0.0, 10.0, 1000.0}) {
    WholePatch whole(icosphere(4), random_seeds(icosphere(4), 150, 7));
    double way = 0;
    for (int sweep = 0; sweep < 5; ++sweep)
      for (Index v = 0; v < 150; ++v) whole.patch.relax(v, hold);
    for (Index v = 0; v < 150; ++v) way += norm2(whole.patch.vertices()[v].x - whole.seeds[v]);
    EXPECT_LT(way, last);
    last = way;
  }
}

// --- The pass ---

struct Problem {
  Problem(const TriangleMesh& mesh, std::size_t count, int iterations, FeatureGraph graph = {})
      : surface(mesh), backend(surface, NeighbourSource::nearest), curves(graph, surface.mesh.vertices),
        trace(surface, curves), input(analyse_topology(mesh.triangles, mesh.vertices.size())),
        run(backend, curves, context) {
    place_and_optimise(run, trace, count, iterations);
    before = run.seeds;
    quality_before = quality();
  }

  const Diagram& diagram() { return run.diagram(Want::polygons | Want::dual); }
  TriangleMesh dual() { return dual_mesh(run.seeds.positions(), diagram().dual); }
  QualityReport quality() { return measure_quality(dual()); }
  std::vector<Index> broken_curves() { return check_features(trace, curves, run.seeds.places(), diagram()).broken; }
  ImproveReport improve_to(std::size_t count, double min_angle = 40) {
    return improve(run, trace, {min_angle, 91, count});
  }
  // That seeds and diagram belong together and nothing is worse than before.
  void expect_sound(std::size_t count) {
    EXPECT_EQ(run.seeds.size(), count);
    const int evaluations = run.totals.evaluations;
    const Diagram& found = run.diagram(run.traced());
    EXPECT_EQ(run.totals.evaluations, evaluations) << "the final diagram is at hand";
    const Diagram d = diagram_of(surface, run.seeds.positions(), NeighbourSource::nearest);
    EXPECT_EQ(triples_of(found.polygons), triples_of(d.polygons));
    expect_same_moments(found.moments, d.moments);
    EXPECT_EQ(run.energy, d.moments.energy);
    const QualityReport after = quality(), &was = quality_before;
    EXPECT_TRUE(same_topology(after.topology, input));
    EXPECT_GE(after.theta_min, std::min(was.theta_min, 40.0) - 1e-9);
    EXPECT_LE(after.theta_max, std::max(was.theta_max, 91.0) + 1e-9);
    EXPECT_GE(after.q_ave, was.q_ave);
    EXPECT_GE(after.theta_min_ave, was.theta_min_ave);
    const double tolerance = 1e-12 * bounding_box(surface.mesh.vertices).diagonal();
    for (const Vec3& x : run.seeds.positions()) EXPECT_LE(norm(nearest_of_all(surface, x) - x), tolerance);
  }

  Surface surface;
  CpuBackend backend;
  FeatureCurves curves;
  FeatureTrace trace;
  MeshTopology input;
  Context context;
  CvtRun run;
  PlacedSeeds before;
  QualityReport quality_before;
};

// Few steps leave poor triangles, as a bad local minimum would.
TEST(Improve, MendsSmoothSurfaces) {
  for (const TriangleMesh& mesh : {icosphere(4), torus(80, 48)}) {
    Problem problem(mesh, 600, 8);
    ASSERT_LT(problem.quality_before.theta_min, 40);
    const ImproveReport report = problem.improve_to(600);
    problem.expect_sound(600);
    EXPECT_EQ(report.missed, 0u);
    EXPECT_GE(problem.quality().theta_min, 40);
    EXPECT_LE(problem.quality().theta_max, 91);
    EXPECT_GE(problem.quality().valence6, problem.quality_before.valence6);
  }
}

TEST(Improve, CountsTheTrianglesThatItMissed) {
  Problem problem(icosphere(4), 300, 10);
  const ImproveReport report = problem.improve_to(300, 55);
  const TriangleMesh mesh = problem.dual();
  std::size_t missed = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    missed += shape_excess(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], shape_goal(55, 91)).most() > 0;
  EXPECT_GT(missed, 0u);
  EXPECT_EQ(report.missed, missed);
}

TEST(Improve, MeetsTheCount) {
  for (const int off : {-3, 4}) {
    Problem problem(icosphere(4), static_cast<std::size_t>(400 + off), 25);
    const ImproveReport report = problem.improve_to(400);
    problem.expect_sound(400);
    EXPECT_EQ(static_cast<int>(report.inserted) - static_cast<int>(report.removed), -off);
  }
}

// Of equal seeds the first owns everything, the others are no vertices.
TEST(Improve, ReplacesSeedsThatOwnNothing) {
  Problem problem(icosphere(4), 300, 25);
  for (const Index i : {7u, 8u}) problem.run.seeds.edit_positions()[i] = problem.run.seeds.position(20);
  problem.quality_before = problem.quality();
  ASSERT_EQ(problem.dual().vertices.size(), 298u);
  problem.improve_to(300);
  problem.expect_sound(300);
  EXPECT_EQ(problem.dual().vertices.size(), 300u);
}

// Every edge of the cube is a curve, every corner of it a corner.
FeatureGraph cube_features(const TriangleMesh& mesh) {
  FeatureGraph graph = detect_features(mesh);
  EXPECT_EQ(graph.curves.size(), 12u);
  EXPECT_EQ(graph.corners.size(), 8u);
  return graph;
}

TEST(Improve, KeepsFeatures) {
  const TriangleMesh mesh = box(8);
  Problem problem(mesh, 700, 15, cube_features(mesh));
  ASSERT_TRUE(problem.broken_curves().empty());
  problem.improve_to(700);
  problem.expect_sound(700);
  EXPECT_TRUE(problem.broken_curves().empty());
  std::vector<int> at_corner(8, 0);
  for (std::size_t i = 0; i < problem.run.seeds.size(); ++i) {
    const SeedPlace& place = problem.run.seeds.place(i);
    const Vec3& x = problem.run.seeds.position(i);
    if (place.corner != kNone) {
      ++at_corner[place.corner];
      EXPECT_EQ(x, problem.curves.corner(place.corner));
    } else if (place.kind == Kind::curve) {
      EXPECT_EQ(x, problem.curves.point(place.curve, place.position));
    }
  }
  EXPECT_EQ(at_corner, std::vector<int>(8, 1));
  // A seed that recovery fixed on a curve may go, but not move.
  for (std::size_t i = 0; i < problem.run.seeds.size(); ++i) {
    if (problem.run.seeds.kind(i) != Kind::fixed) continue;
    const std::vector<Vec3>& before = problem.before.positions();
    const auto was = std::find(before.begin(), before.end(), problem.run.seeds.position(i));
    ASSERT_NE(was, before.end());
    EXPECT_EQ(problem.before.kind(static_cast<std::size_t>(was - before.begin())), Kind::fixed);
  }
}

// Where a border is no feature, its seeds would creep inwards.
TEST(Improve, LeavesSeedsAtABorderWhereTheyAre) {
  Problem problem(wavy_patch(40), 400, 25);
  const auto border = [](Problem& r) {
    std::map<std::array<Index, 2>, int> edges;
    for (const Triangle& t : triples_of(r.run.diagram(Want::polygons).polygons))
      for (int m = 0; m < 3; ++m) ++edges[{std::min(t[m], t[(m + 1) % 3]), std::max(t[m], t[(m + 1) % 3])}];
    std::vector<std::array<double, 3>> ends;
    for (const auto& [e, count] : edges)
      if (count == 1)
        for (const Index v : e) {
          const Vec3& x = r.run.seeds.position(v);
          ends.push_back({x.x, x.y, x.z});
        }
    std::sort(ends.begin(), ends.end());
    return ends;
  };
  const auto before = border(problem);
  EXPECT_FALSE(before.empty());
  problem.improve_to(400);
  problem.expect_sound(400);
  EXPECT_EQ(border(problem), before);
}

TEST(Improve, RepeatsWithAnyNumberOfThreads) {
  std::vector<Vec3> reference;
  for (const unsigned threads : {1u, 2u, 3u}) {
    const ThreadLimit limit(threads);
    Problem problem(torus(80, 48), 500, 15);
    problem.improve_to(500);
    if (reference.empty()) reference = problem.run.seeds.positions();
    EXPECT_TRUE(same_bits(problem.run.seeds.positions(), reference));
  }
}

TEST(Improve, CanBeCancelled) {
  Problem problem(icosphere(3), 100, 5);
  std::atomic<bool> cancel = true;
  problem.context.cancel = &cancel;
  EXPECT_THROW(problem.improve_to(100), Cancelled);
}

// Duals that are not manifold, seeds that are too few: nothing to win, nothing to lose.
TEST(Improve, LeavesHardInputsNoWorse) {
  for (const TriangleMesh& mesh : {pages(), soup(40, 2), box(1), two_spheres()})
    for (const std::size_t count : {6u, 60u}) {
      Problem problem(mesh, count, 10);
      const QualityReport was = problem.quality_before;
      problem.improve_to(count);
      const QualityReport after = problem.quality();
      EXPECT_EQ(after.topology.euler, was.topology.euler);
      EXPECT_EQ(after.topology.manifold, was.topology.manifold);
      EXPECT_GE(after.theta_min, std::min(was.theta_min, 40.0) - 1e-9);
      EXPECT_LE(after.theta_max, std::max(was.theta_max, 91.0) + 1e-9);
    }
}

}  // namespace
}  // namespace bisector::test
