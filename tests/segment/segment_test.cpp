#include "bisector/segment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/region_borders.h"
#include "core/parallel.h"
#include "segment/dual_graph.h"
#include "support/csg.h"
#include "support/models.h"

namespace bisector {
namespace {

// Every label in use, one connected part each, and what is reported about regions and borders is what the labels say.
void expect_sound(const TriangleMesh& mesh, const SegmentResult& result) {
  ASSERT_EQ(result.labels.size(), mesh.triangles.size());
  const DualGraph graph = dual_graph(mesh.triangles, mesh.vertices);
  std::vector<std::size_t> triangles(result.regions.size(), 0);
  for (const Index l : result.labels) {
    ASSERT_LT(l, result.regions.size());
    ++triangles[l];
  }
  for (std::size_t r = 0; r < triangles.size(); ++r) EXPECT_EQ(triangles[r], result.regions[r].triangles);
  const std::vector<Index> parts = connected_parts(graph, result.labels);
  EXPECT_EQ(1 + *std::max_element(parts.begin(), parts.end()), result.regions.size());
  EXPECT_NEAR(border_length(graph, result.labels), result.border_after, 1e-9 * (1 + result.border_after));
  for (std::size_t r = 1; r < result.regions.size(); ++r)
    EXPECT_GE(result.regions[r - 1].area, result.regions[r].area * (1 - 1e-12));
  double squares = 0, area = 0;
  for (const SegmentRegion& region : result.regions) {
    EXPECT_LE(region.rms, region.max);
    squares += region.rms * region.rms * region.area;
    area += region.area;
  }
  // Approximate distances to general quadrics, exact ones to the others: below within rounding.
  EXPECT_LE(result.rms, std::sqrt(squares / area) * (1 + 1e-6) + 1e-12);
}

void expect_falling(const SegmentResult& result) {
  ASSERT_FALSE(result.energies.empty());
  for (const std::vector<double>& run : result.energies)
    for (std::size_t k = 1; k < run.size(); ++k) EXPECT_LT(run[k], run[k - 1]);
}

TriangleMesh open_strip() {
  // A sheet folded at right angles along a line, without a border in common with itself.
  TriangleMesh mesh;
  constexpr Index n = 12;
  for (Index i = 0; i <= n; ++i)
    for (Index j = 0; j <= n; ++j) {
      const double x = i / 12.0, y = j / 12.0;
      mesh.vertices.push_back(x < 0.5 ? Vec3{x, y, 0} : Vec3{0.5, y, x - 0.5});
    }
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) {
      const Index a = i * (n + 1) + j, b = a + n + 1;
      mesh.triangles.push_back({a, b, b + 1});
      mesh.triangles.push_back({a, b + 1, a + 1});
    }
  return mesh;
}

TEST(Segment, FindsTheTwoPlanesOfAFold) {
  const TriangleMesh mesh = open_strip();
  SegmentOptions options;
  options.proxies = 2;
  const SegmentResult result = segment(mesh, options);
  expect_sound(mesh, result);
  for (const SegmentRegion& region : result.regions) {
    EXPECT_EQ(type_of(region.proxy), SurfaceType::plane);
    EXPECT_LT(region.max, 1e-12);
    EXPECT_NEAR(region.area, 0.5, 1e-12);
  }
}

TEST(Segment, TwoPlanesAreNoQuadric) {
  // One region cannot be had without error, though a pair of planes would pass through all of it.
  SegmentOptions options;
  options.proxies = 1;
  const SegmentResult one = segment(open_strip(), options);
  EXPECT_NE(type_of(one.regions[0].proxy), SurfaceType::plane_pair);
  EXPECT_GT(one.rms, 0.005);
}

TEST(Segment, MeetsTheErrorAskedFor) {
  const test::CsgModel model = test::turned_part(4000, 0, 3);
  const double diagonal = bounding_box(model.mesh.vertices).diagonal();
  std::size_t before = model.mesh.triangles.size();
  for (const double error : {0.05, 0.2, 1.0}) {
    SegmentOptions options;
    options.error = error;
    const SegmentResult result = segment(model.mesh, options);
    expect_sound(model.mesh, result);
    expect_falling(result);
    EXPECT_LE(result.rms, error / 100 * diagonal);
    EXPECT_LE(result.regions.size(), before);
    before = result.regions.size();
  }
}

TEST(Segment, EveryStartIsSoundAndItsEnergyFalls) {
  const test::CsgModel model = test::csg_part(4000, 5e-4, 1);
  for (const SegmentStart start : {SegmentStart::merging, SegmentStart::insertion, SegmentStart::random})
    for (const SegmentSurfaces surfaces : {SegmentSurfaces::planes, SegmentSurfaces::quadrics, SegmentSurfaces::all}) {
      SCOPED_TRACE(std::to_string(static_cast<int>(start)) + " " + std::to_string(static_cast<int>(surfaces)));
      SegmentOptions options;
      options.proxies = 13;
      options.start = start;
      options.surfaces = surfaces;
      const SegmentResult result = segment(model.mesh, options);
      EXPECT_EQ(result.regions.size(), 13u);
      expect_sound(model.mesh, result);
      expect_falling(result);
      for (const SegmentRegion& region : result.regions) {
        EXPECT_TRUE(surfaces != SegmentSurfaces::planes || type_of(region.proxy) == SurfaceType::plane);
        EXPECT_TRUE(surfaces != SegmentSurfaces::quadrics || type_of(region.proxy) != SurfaceType::torus);
      }
    }
}

TEST(Segment, IsTheSameForAnyNumberOfThreadsAndOnlyTheRandomStartDependsOnItsSeed) {
  const test::CsgModel model = test::csg_part(3000, 1e-3, 5);
  const auto labels = [&](SegmentStart start, std::uint64_t seed, unsigned threads) {
    const ThreadLimit limit(threads);
    SegmentOptions options;
    options.proxies = 13;
    options.start = start;
    options.random_seed = seed;
    return segment(model.mesh, options).labels;
  };
  for (const SegmentStart start : {SegmentStart::merging, SegmentStart::insertion, SegmentStart::random})
    EXPECT_EQ(labels(start, 1, 1), labels(start, 1, 4));
  EXPECT_EQ(labels(SegmentStart::merging, 1, 2), labels(SegmentStart::merging, 2, 2));
  EXPECT_EQ(labels(SegmentStart::insertion, 1, 2), labels(SegmentStart::insertion, 2, 2));
}

TEST(Segment, DoesNotDependOnUnitsOrPlace) {
  const test::CsgModel model = test::csg_part(3000, 0, 2);
  TriangleMesh moved = model.mesh;
  for (Vec3& v : moved.vertices) v = 1024.0 * v + Vec3{1e5, -2e5, 3e4};
  SegmentOptions options;
  options.proxies = 13;
  const SegmentResult here = segment(model.mesh, options), there = segment(moved, options);
  // Regions of nearly equal area may swap their numbers.
  const auto neighbours = dual_graph(model.mesh.triangles, model.mesh.vertices).neighbours;
  std::size_t same = 0;
  for (std::size_t t = 0; t < here.labels.size(); ++t)
    for (const Index* n = neighbours.begin(t); n != neighbours.end(t); ++n)
      same += (here.labels[t] == here.labels[*n]) == (there.labels[t] == there.labels[*n]);
  EXPECT_GT(same, neighbours.values.size() * 99 / 100);
  EXPECT_NEAR(there.rms, 1024 * here.rms, 1e-3 * 1024 * here.rms);
}

TEST(Segment, EachComponentHasItsOwnRegions) {
  TriangleMesh mesh = open_strip();
  const TriangleMesh one = mesh;
  for (const Vec3& v : one.vertices) mesh.vertices.push_back(v + Vec3{3, 0, 0});
  const auto shift = static_cast<Index>(one.vertices.size());
  for (const auto& [a, b, c] : one.triangles) mesh.triangles.push_back({a + shift, b + shift, c + shift});
  SegmentOptions options;
  options.proxies = 4;
  const SegmentResult result = segment(mesh, options);
  expect_sound(mesh, result);
  EXPECT_LT(result.rms, 1e-12);
  // Fewer than there are components: one each, and a warning.
  options.proxies = 1;
  std::vector<std::string> warnings;
  Context context;
  context.warning = [&](const std::string& text) { warnings.push_back(text); };
  const SegmentResult fewest = segment(mesh, options, context);
  expect_sound(mesh, fewest);
  EXPECT_EQ(fewest.regions.size(), 2u);
  EXPECT_EQ(warnings.size(), 1u);
}

// As programs write faces that have normals or texture coordinates of their own.
TEST(Segment, FacesWithVerticesOfTheirOwnAreNeighbours) {
  const TriangleMesh whole = test::box(4), apart = test::torn(whole);
  SegmentOptions options;
  options.proxies = 6;
  options.project = true;
  const SegmentResult expected = segment(whole, options), result = segment(apart, options);
  EXPECT_EQ(result.labels, expected.labels);
  ASSERT_EQ(result.projected.size(), apart.vertices.size());
  for (std::size_t t = 0; t < whole.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(result.projected[apart.triangles[t][k]], expected.projected[whole.triangles[t][k]]);
  EXPECT_EQ(region_borders(apart, result).chains.size(), region_borders(whole, expected).chains.size());
}

TEST(Segment, AsksForNoMoreRegionsThanThereAreTriangles) {
  const TriangleMesh mesh = open_strip();
  SegmentOptions options;
  options.proxies = 100'000;
  std::vector<std::string> warnings;
  Context context;
  context.warning = [&](const std::string& text) { warnings.push_back(text); };
  const SegmentResult result = segment(mesh, options, context);
  expect_sound(mesh, result);
  EXPECT_LE(result.regions.size(), mesh.triangles.size());
  EXPECT_EQ(warnings.size(), 1u);
}

TEST(Segment, TakesNonManifoldEdgesAndTrianglesWithoutArea) {
  TriangleMesh mesh = open_strip();
  // A third sheet on the fold, and degenerate triangles.
  const auto first = static_cast<Index>(mesh.vertices.size());
  for (Index j = 0; j <= 12; ++j) mesh.vertices.push_back({1, j / 12.0, 0});
  for (Index j = 0; j < 12; ++j) {
    mesh.triangles.push_back({6 * 13 + j, first + j, first + j + 1});
    mesh.triangles.push_back({6 * 13 + j, first + j + 1, 6 * 13 + j + 1});
  }
  mesh.triangles.push_back({0, 1, 1});
  mesh.triangles.push_back({0, 1, 2});
  SegmentOptions options;
  options.proxies = 4;
  const SegmentResult result = segment(mesh, options);
  expect_sound(mesh, result);
  EXPECT_LT(result.rms, 1e-9);
}

TEST(Segment, SmoothingNeverRaisesTheDistanceFar) {
  const test::CsgModel model = test::csg_part(5000, 1e-3, 4);
  for (const double lambda : {0.5, 2.0, 20.0}) {
    SegmentOptions options;
    options.proxies = 13;
    options.smooth = lambda;
    options.fuzzy_rings = 3;
    const SegmentResult result = segment(model.mesh, options);
    expect_sound(model.mesh, result);
    EXPECT_LE(result.rms, 1.05 * result.rms_before * (1 + 1e-9));
    EXPECT_LE(result.border_after, result.border_before * (1 + 1e-9));
    EXPECT_LE(result.smooth, lambda);
  }
}

TEST(Segment, RefusesWhatCannotBe) {
  const TriangleMesh mesh = open_strip();
  const auto refused = [&](auto change, const char* word) {
    SegmentOptions options;
    change(options);
    try {
      segment(mesh, options);
      FAIL() << word;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  refused([](SegmentOptions& o) { o.error = 0; }, "error");
  refused([](SegmentOptions& o) { o.error = std::nan(""); }, "error");
  refused([](SegmentOptions& o) { o.smooth = -1; }, "smoothing");
  refused([](SegmentOptions& o) { o.fuzzy_rings = -1; }, "rings");
  refused([](SegmentOptions& o) { o.iterations = -1; }, "iterations");
  TriangleMesh point;
  point.vertices = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  point.triangles = {{0, 1, 2}};
  EXPECT_THROW(segment(point, {}), Error);
}

TEST(Segment, StopsWhenAsked) {
  const test::CsgModel model = test::csg_part(3000, 0, 2);
  const std::atomic<bool> cancel = true;
  Context context;
  context.cancel = &cancel;
  EXPECT_THROW(segment(model.mesh, {}, context), Cancelled);
}

}  // namespace
}  // namespace bisector
