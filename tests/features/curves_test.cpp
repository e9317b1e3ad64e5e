// Seeds on feature curves: places, gradients along them, which cells a curve runs through, and its recovery in the
// dual.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "backend/cpu_backend.h"
#include "core/geometry.h"
#include "cvt/multilevel.h"
#include "cvt/optimise.h"
#include "features/curves.h"
#include "remesh/feature_recovery.h"
#include "support/diagram.h"
#include "support/featured.h"
#include "support/models.h"
#include "voronoi/dual.h"

namespace bisector::test {
namespace {

// --- Geometry of curves ---

TEST(Curves, PointsByArcLength) {
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {0, 2, 0}};
  FeatureGraph graph;
  graph.curves = {{{0, 1, 2, 3}, true}};
  const FeatureCurves curves(graph, square);
  EXPECT_EQ(curves.length(0), 6);
  EXPECT_EQ(curves.segments(0), 4u);
  EXPECT_EQ(curves.point(0, 0), (Vec3{0, 0, 0}));
  EXPECT_EQ(curves.point(0, 2), (Vec3{1, 1, 0}));
  EXPECT_EQ(curves.point(0, 5), (Vec3{0, 1, 0}));
  EXPECT_EQ(curves.tangent(0, 5), (Vec3{0, -1, 0}));
  EXPECT_EQ(curves.wrap(0, 7), 1);
  EXPECT_EQ(curves.wrap(0, -1), 5);
  EXPECT_EQ(curves.ends(0)[0], kNone);
}

TEST(Curves, NearestIsTheNearestWithinReach) {
  SplitMix64 random(5);
  for (bool closed : {false, true})
    for (int trial = 0; trial < 60; ++trial) {
      std::vector<Vec3> points;
      FeatureGraph graph;
      graph.curves.push_back({{}, closed});
      for (Index k = 0; k < 9; ++k) {
        points.push_back({random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)});
        graph.curves[0].vertices.push_back(k);
      }
      graph.corners = {0, 8};
      const FeatureCurves curves(graph, points);
      const Vec3 p{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
      const double from = random.range(0, curves.length(0)), reach = random.range(0, 0.6) * curves.length(0);
      const double found = curves.nearest(0, p, from, reach);
      double gap = std::abs(found - from);
      if (closed) gap = std::min(gap, curves.length(0) - gap);
      EXPECT_LE(gap, reach + 1e-12);
      double best = std::numeric_limits<double>::infinity();
      for (int k = -2000; k <= 2000; ++k)
        best = std::min(best, norm(curves.point(0, curves.wrap(0, from + reach * k / 2000)) - p));
      EXPECT_LE(norm(curves.point(0, found) - p), best + 1e-12);
    }
}

// --- Gradients and steps along curves ---

TEST(Curves, GradientIsTheSlopeOfTheEnergyAlongPlaces) {
  for (const FeaturedModel& model : featured_models()) {
    SCOPED_TRACE(model.name);
    const PlacedProblem problem(model.mesh, 150);
    CpuBackend backend(problem.surface, NeighbourSource::nearest);
    expect_slopes(backend, problem, problem.completed_on(backend), {1e-4, 1e-4, 1});
  }
}

TEST(Curves, OptimisingKeepsSeedsOnTheirPlaces) {
  for (const FeaturedModel& model : featured_models()) {
    SCOPED_TRACE(model.name);
    const Surface surface(model.mesh);
    const FeatureCurves curves(sharp_graph(model.mesh), model.mesh.vertices);
    const CurveMeasure measure(surface, curves);
    CpuBackend backend(surface, NeighbourSource::nearest);
    PlacedSeeds placed = seeds_on_features(curves, measure, measure.scale(200));
    placed.add(random_seeds(model.mesh, 150, 7));
    for (bool constrained : {false, true}) {
      const Context context;
      CvtRun run(backend, curves, context);
      run.seeds = placed;
      OptimiseOptions options;
      options.iterations = 20;
      options.constrained = constrained;
      const double before = run.diagram().moments.energy;
      optimise(run, options);
      EXPECT_LT(run.energy, before);
      ASSERT_EQ(run.seeds.size(), placed.size());
      bool moved = false;
      for (std::size_t i = 0; i < run.seeds.size(); ++i) {
        const SeedPlace &place = run.seeds.place(i), &start = placed.place(i);
        EXPECT_EQ(place.kind, start.kind);
        EXPECT_EQ(place.curve, start.curve);
        if (place.kind == SeedPlace::Kind::fixed) {
          EXPECT_EQ(run.seeds.position(i), placed.position(i));
        }
        if (place.kind != SeedPlace::Kind::curve) continue;
        EXPECT_EQ(run.seeds.position(i), curves.point(place.curve, place.position));
        moved = moved || place.position != start.position;
      }
      EXPECT_TRUE(moved || model.mesh.vertices.size() < 10);
    }
  }
}

// --- How many seeds ---

TEST(CurveMeasure, ScaleIsTheEdgeLengthOfEquilateralTriangles) {
  // A 60 x 52 patch of squares of side 1: N = area / (sqrt(3) / 2 h^2) + border / (2 h).
  const TriangleMesh mesh = grid_patch(60, 52);
  const Surface surface(mesh);
  const FeatureCurves curves(sharp_graph(mesh), mesh.vertices);
  const CurveMeasure measure(surface, curves);
  for (double h : {0.5, 1.0, 3.0}) {
    const double count = 60 * 52 / (std::sqrt(3.0) / 2 * h * h) + 2 * (60 + 52) / (2 * h);
    EXPECT_NEAR(measure.scale(static_cast<std::size_t>(std::lround(count))), h, 2e-3 * h);
  }
  // Density 16 halves every edge: c counts edges in units of rho^(-1/4).
  const Surface dense(mesh, std::vector<double>(mesh.vertices.size(), 16));
  const CurveMeasure halves(dense, curves);
  EXPECT_NEAR(halves.scale(1000), 2 * measure.scale(1000), 1e-12);
  EXPECT_NEAR(halves.edge_length(0, 1, 2 * measure.scale(1000)), measure.scale(1000), 1e-12);
}

TEST(CurveMeasure, PositionsInvertMeasuresAndFollowTheDensity) {
  const TriangleMesh mesh = box(8);
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(std::pow(1 + 3 * v.x, 4));  // edges shrink as 1 / (1 + 3 x)
  const Surface surface(mesh, density);
  const FeatureCurves curves(sharp_graph(mesh), mesh.vertices);
  ASSERT_EQ(curves.size(), 12u);
  const CurveMeasure measure(surface, curves);
  for (Index c = 0; c < curves.size(); ++c)
    for (double t : {0.0, 0.21, 0.5, 0.77, 1.0}) {
      const double position = t * curves.length(c);
      EXPECT_NEAR(measure.position(c, measure.at(c, position)), position, 1e-12);
      const Vec3 p = curves.point(c, position);
      // The fourth root is taken as linear between vertices, which it is here.
      const double length = measure.edge_length(c, std::clamp(position, 1e-9, curves.length(c) - 1e-9), 1);
      EXPECT_NEAR(length, 1 / (1 + 3 * p.x), 0.2 * length);
    }
  const PlacedSeeds placed = seeds_on_features(curves, measure, 0.1);
  EXPECT_EQ(std::count_if(placed.places().begin(), placed.places().end(),
                          [](const SeedPlace& p) { return p.corner != kNone; }),
            8);
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const SeedPlace& p = placed.place(i);
    const Vec3 at = p.corner != kNone ? curves.corner(p.corner) : curves.point(p.curve, p.position);
    EXPECT_EQ(placed.position(i), at);
  }
}

// --- Cells along a curve ---

TEST(FeatureTrace, IntervalsCoverEachCurveAndBelongToTheNearestSeed) {
  for (const FeaturedModel& model : featured_models()) {
    SCOPED_TRACE(model.name);
    const Surface surface(model.mesh);
    const FeatureCurves curves(sharp_graph(model.mesh), model.mesh.vertices);
    const FeatureTrace trace(surface, curves);
    for (const std::vector<Vec3>& seeds :
         {random_seeds(model.mesh, 60, 4), vertex_seeds(model.mesh), grid_seeds(model.mesh, 4, 4, 4)}) {
      const Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
      const auto traces = trace.trace(diagram.polygons);
      ASSERT_EQ(traces.size(), curves.size());
      for (Index c = 0; c < curves.size(); ++c) {
        ASSERT_FALSE(traces[c].empty());
        EXPECT_NEAR(traces[c].front().from, 0, 1e-12);
        EXPECT_NEAR(traces[c].back().to, curves.length(c), 1e-12 * curves.length(c));
        for (std::size_t k = 0; k < traces[c].size(); ++k) {
          const CurveInterval& i = traces[c][k];
          EXPECT_LE(i.from, i.to);
          if (k) {
            EXPECT_NE(traces[c][k - 1].cell, i.cell);
            EXPECT_NEAR(traces[c][k - 1].to, i.from, 1e-10 * curves.length(c));
          }
          const Vec3 middle = curves.point(c, 0.5 * (i.from + i.to));
          double best = std::numeric_limits<double>::infinity();
          for (const Vec3& x : seeds) best = std::min(best, norm(x - middle));
          EXPECT_NEAR(norm(seeds[i.cell] - middle), best, 1e-12);
        }
      }
    }
  }
}

// --- Recovery ---

class Recovery : public testing::TestWithParam<int> {};

TEST_P(Recovery, EveryCurveIsAChainOfDualEdges) {
  const FeaturedModel model = featured_models()[static_cast<std::size_t>(GetParam())];
  const Surface surface(model.mesh);
  const FeatureCurves curves(sharp_graph(model.mesh), model.mesh.vertices);
  const CurveMeasure measure(surface, curves);
  const FeatureTrace trace(surface, curves);
  CpuBackend backend(surface, NeighbourSource::nearest);
  for (std::size_t count : {60u, 400u}) {
    SCOPED_TRACE(std::string(model.name) + " " + std::to_string(count));
    PlacedSeeds placed = seeds_on_features(curves, measure, measure.scale(count));
    placed.add(random_seeds(model.mesh, count, 11));
    const Context context;
    CvtRun run(backend, curves, context);
    run.seeds = placed;
    OptimiseOptions options;
    options.iterations = 30;
    optimise(run, options);
    clear_features(run, trace, measure, options);
    options.constrained = true;
    const FeatureReport report = recover_features(run, trace, measure, measure.scale(count), options);
    EXPECT_TRUE(report.broken.empty());

    // The chains are edges of the dual, and as long as the curves but for what chords cut off; each corner is among
    // them.
    const Dual& dual = run.diagram(Want::polygons | Want::dual).dual;
    std::set<std::array<Index, 2>> dual_edges;
    for (const Triangle& t : dual.triangles)
      for (int m = 0; m < 3; ++m) dual_edges.insert({std::min(t[m], t[(m + 1) % 3]), std::max(t[m], t[(m + 1) % 3])});
    double length = 0, whole = 0;
    std::set<Index> on_chains;
    for (const auto& [a, b] : report.edges) {
      EXPECT_TRUE(dual_edges.contains({a, b}));
      EXPECT_FALSE(run.seeds.on_surface(a));
      EXPECT_FALSE(run.seeds.on_surface(b));
      length += norm(run.seeds.position(a) - run.seeds.position(b));
      on_chains.insert(a);
      on_chains.insert(b);
    }
    for (Index c = 0; c < curves.size(); ++c) whole += curves.length(c);
    EXPECT_LE(length, whole * (1 + 1e-12));
    EXPECT_GE(length, 0.97 * whole);
    for (Index i = 0; i < run.seeds.size(); ++i)
      if (!run.seeds.on_surface(i)) {
        EXPECT_TRUE(on_chains.contains(i)) << i;
      }
  }
}

INSTANTIATE_TEST_SUITE_P(Models, Recovery, testing::Range(0, static_cast<int>(featured_models().size())),
                         [](const auto& test) {
                           return std::string(featured_models()[static_cast<std::size_t>(test.param)].name);
                         });

TEST(RecoveryReport, AMissingCurveIsReported) {
  const TriangleMesh mesh = box(4);
  const Surface surface(mesh);
  const FeatureCurves curves(sharp_graph(mesh), mesh.vertices);
  const FeatureTrace trace(surface, curves);
  const std::vector<Vec3> seeds = random_seeds(mesh, 100, 2);
  Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
  diagram.dual = extract_dual(diagram.polygons);
  const FeatureReport report = check_features(trace, curves, std::vector<SeedPlace>(seeds.size()), diagram);
  EXPECT_EQ(report.broken.size(), 12u);
}

// Refining keeps seeds on curves at twice as many, and gives the count asked for.
TEST(RecoveryLevels, RefiningDoublesCurvesAndKeepsTheCount) {
  const TriangleMesh mesh = cylinder(64);
  const Surface surface(mesh);
  const FeatureCurves curves(sharp_graph(mesh), mesh.vertices);
  const CurveMeasure measure(surface, curves);
  CpuBackend backend(surface, NeighbourSource::nearest);
  PlacedSeeds coarse = seeds_on_features(curves, measure, 0.3);
  const std::size_t on_curves = coarse.size();
  coarse.add(random_seeds(mesh, 150, 11));
  const PlacedSeeds features = seeds_on_features(curves, measure, 0.15, coarse.places());
  EXPECT_NEAR(static_cast<double>(features.size()), 2.0 * static_cast<double>(on_curves), 2.0);
  const PlacedSeeds finer = refine(diagram_of(backend, coarse.positions()), coarse, curves, features, 600);
  EXPECT_EQ(finer.size(), 600u);
  EXPECT_TRUE(std::equal(features.positions().begin(), features.positions().end(), finer.positions().begin()));
}

}  // namespace
}  // namespace bisector::test
