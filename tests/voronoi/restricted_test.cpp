// The restricted Voronoi diagram against the oracle on small cases, and against itself on large ones: both neighbour
// sources, any number of threads, objects fresh and used must agree in every bit.
#include "voronoi/restricted.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/lanes.h"
#include "support/diagram.h"
#include "support/models.h"
#include "support/oracle.h"
#include "voronoi/clip.h"
#include "voronoi/fixed_tree_sum.h"
#include "voronoi/polygon_batch.h"

namespace bisector::test {
namespace {

constexpr NeighbourSource kSources[] = {NeighbourSource::nearest, NeighbourSource::delaunay};

// --- Against the oracle ---

// The labels from the smallest on.
std::vector<Index> rotated(std::vector<Index> cycle) {
  std::rotate(cycle.begin(), std::min_element(cycle.begin(), cycle.end()), cycle.end());
  return cycle;
}

std::vector<Index> cycle_of(const RestrictedPolygons& polygons, std::size_t k) {
  const auto at = [&](std::size_t p) {
    return polygons.labels.begin() + static_cast<std::ptrdiff_t>(polygons.offsets[p]);
  };
  return rotated({at(k), at(k + 1)});
}

std::vector<Index> cycle_of(const OraclePolygon& polygon) {
  std::vector<Index> labels;
  for (std::int64_t e : polygon.edges)
    labels.push_back(e < 0 ? kEdgeLabel | static_cast<Index>(-1 - e) : static_cast<Index>(e));
  return rotated(labels);
}

bool has_area(const TriangleMesh& mesh) {
  return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& t) {
    return !collinear(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  });
}

// Largest distance of a point of the mesh to a seed.
double reach_of(const TriangleMesh& mesh, const std::vector<Vec3>& seeds) {
  double reach = 0;
  for (const Vec3& q : mesh.vertices)
    for (const Vec3& x : seeds) reach = std::max(reach, norm(q - x));
  return reach;
}

void expect_oracle(const SmallCase& problem) {
  SCOPED_TRACE(problem.name);
  const auto& [name, mesh, seeds] = problem;
  const OracleDiagram want = oracle_diagram(mesh, seeds);
  if (!has_area(mesh)) {
    EXPECT_TRUE(want.pairs.empty());
    EXPECT_THROW(Surface{mesh}, Error);
    return;
  }
  const std::vector<OraclePolygon> polygons = oracle_polygons(mesh, seeds);
  const Surface surface(mesh);
  const double reach = reach_of(mesh, seeds);
  for (NeighbourSource source : kSources)
    for (unsigned threads : {1u, 2u}) {
      SCOPED_TRACE(source == NeighbourSource::nearest ? "nearest" : "delaunay");
      const ThreadLimit limit(threads);
      const Diagram got = diagram_of(surface, seeds, source);
      expect_sound(surface, got);
      EXPECT_EQ(pairs_of(got.polygons), want.pairs);
      EXPECT_EQ(triples_of(got.polygons), want.rdt);
      ASSERT_EQ(got.polygons.pairs.size(), polygons.size());
      for (std::size_t k = 0; k < polygons.size(); ++k)
        EXPECT_EQ(cycle_of(got.polygons, k), cycle_of(polygons[k])) << "polygon " << k;
      for (std::size_t i = 0; i < seeds.size(); ++i) {
        const Moments& cell = got.moments.cells[i];
        EXPECT_NEAR(cell.mass, want.mass[i], 1e-12 * surface.area) << "seed " << i;
        const Vec3 first = want.mass[i] * (want.centroid[i] - seeds[i]);
        EXPECT_LE(norm(cell.first - first), 1e-12 * surface.area * reach) << "seed " << i;
        EXPECT_NEAR(cell.second, want.energy[i], 1e-12 * surface.area * reach * reach) << "seed " << i;
      }
      if (testing::Test::HasFailure()) return;
    }
}

class Small : public testing::TestWithParam<SmallCase> {};

TEST_P(Small, AgreesWithTheOracle) { expect_oracle(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Restricted, Small, testing::ValuesIn(small_cases()),
                         [](const auto& instance) { return test_name(instance.param.name); });

class Integers : public testing::TestWithParam<std::uint64_t> {};

constexpr std::uint64_t kIntegerCases = 8000, kIntegerBlock = 500;

TEST_P(Integers, AgreeWithTheOracle) {
  for (std::uint64_t k = GetParam(); k < GetParam() + kIntegerBlock && !HasFailure(); ++k)
    expect_oracle(integer_case(k));
}

INSTANTIATE_TEST_SUITE_P(Restricted, Integers, testing::Range(std::uint64_t{0}, kIntegerCases, kIntegerBlock));

TEST(Restricted, NearTiesAgreeWithTheOracle) {
  constexpr std::uint64_t kCases = 600;
  for (std::uint64_t k = 0; k < kCases && !HasFailure(); ++k) expect_oracle(near_tie_case(k));
}

// A large grid problem, where the neighbour lists do not hold every seed.
TEST(Restricted, LargerGridAgreesWithTheOracle) {
  const TriangleMesh mesh = box(1);
  for (int n : {5, 6}) expect_oracle({"grid", mesh, grid_seeds(mesh, n, n, n)});
}

// --- Medium cases ---

// Every process lists all cases, so what they are of is only made by the tests that run.
struct MediumCase {
  std::string name;
  std::function<TriangleMesh()> make_mesh;
  std::function<std::vector<Vec3>(const TriangleMesh&)> make_seeds;
};

std::vector<Vec3> moved_by(std::vector<Vec3> points, const Vec3& by) {
  for (Vec3& p : points) p += by;
  return points;
}

// Nine tenths within a millionth of a corner of the box.
std::vector<Vec3> clustered_seeds(const TriangleMesh& mesh, std::size_t count) {
  SplitMix64 random(31);
  std::vector<Vec3> seeds = random_seeds(mesh, count / 10, 32);
  const Vec3 centre = mesh.vertices[mesh.triangles[0][0]];
  while (seeds.size() < count)
    seeds.push_back(centre + 1e-6 * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)});
  return seeds;
}

// On a sphere up to rounding; `flat`: on its equator.
std::vector<Vec3> round_seeds(std::size_t count, bool flat) {
  SplitMix64 random(33);
  std::vector<Vec3> seeds;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = flat ? 0 : random.range(-1, 1), phi = random.range(0, 2 * std::numbers::pi);
    const double r = std::sqrt(1 - z * z);
    seeds.push_back({0.5 + 0.75 * r * std::cos(phi), 0.5 + 0.75 * r * std::sin(phi), 0.25 + 0.75 * z});
  }
  return seeds;
}

std::vector<Vec3> box_seeds(const TriangleMesh& mesh, std::size_t count, double margin) {
  SplitMix64 random(34);
  const Box bounds = bounding_box(mesh.vertices);
  const double d = margin * bounds.diagonal();
  std::vector<Vec3> seeds;
  for (std::size_t i = 0; i < count; ++i)
    seeds.push_back({random.range(bounds.lo.x - d, bounds.hi.x + d), random.range(bounds.lo.y - d, bounds.hi.y + d),
                     random.range(bounds.lo.z - d, bounds.hi.z + d)});
  return seeds;
}

std::vector<MediumCase> medium_cases() {
  struct Named {
    const char* name;
    std::function<TriangleMesh()> make;
  };
  const std::vector<Named> meshes{{"icosphere", [] { return icosphere(4); }},
                                  {"box", [] { return box(16); }},
                                  {"grid patch", [] { return grid_patch(40, 30); }},
                                  {"pages", [] { return pages(); }},
                                  {"two spheres", [] { return two_spheres(); }},
                                  {"soup", [] { return soup(400, 41); }},
                                  {"needles", [] { return needles(); }}};
  using Mesh = const TriangleMesh&;
  std::vector<MediumCase> cases;
  for (const auto& [name, make] : meshes) {
    const auto add = [&](const char* what, auto make_seeds) {
      cases.push_back({std::string(name) + " " + what, make, make_seeds});
    };
    add("10 random", [](Mesh mesh) { return random_seeds(mesh, 10, 21); });
    add("1000 random", [](Mesh mesh) { return random_seeds(mesh, 1000, 22); });
    add("4000 random", [](Mesh mesh) { return random_seeds(mesh, 4000, 23); });
    add("vertices", [](Mesh mesh) { return vertex_seeds(mesh); });
    add("vertices twice", [](Mesh mesh) { return repeated(vertex_seeds(mesh), 2); });
    add("grid", [](Mesh mesh) { return grid_seeds(mesh, 11, 11, 11); });
    add("clustered", [](Mesh mesh) { return clustered_seeds(mesh, 2000); });
    add("mirrored", [](Mesh mesh) { return mirrored(random_seeds(mesh, 700, 24), 0); });
    add("planar", [](Mesh mesh) {
      std::vector<Vec3> flat = random_seeds(mesh, 300, 25);
      for (Vec3& x : flat) x.z = 0;
      return flat;
    });
    add("in the box", [](Mesh mesh) { return box_seeds(mesh, 2000, 0.1); });
    add("far", [](Mesh mesh) { return moved_by(random_seeds(mesh, 300, 26), {30, 20, 10}); });
  }
  for (std::size_t k : {0u, 3u, 4u}) {
    const auto& [name, make] = meshes[k];
    cases.push_back({std::string(name) + " cospherical", make, [](Mesh) { return round_seeds(2000, false); }});
    // All cells meet along one line, where every decision is close: the cost grows with the square of the count.
    cases.push_back({std::string(name) + " cocircular", make, [](Mesh) { return round_seeds(120, true); }});
  }
  return cases;
}

class Medium : public testing::TestWithParam<MediumCase> {
 protected:
  const TriangleMesh mesh = GetParam().make_mesh();
  const std::vector<Vec3> seeds = GetParam().make_seeds(mesh);
};

TEST_P(Medium, EverySourceAndThreadCountGivesTheSameBits) {
  const Surface surface(mesh);
  const Diagram reference = diagram_of(surface, seeds, NeighbourSource::nearest);
  expect_sound(surface, reference);
  for (NeighbourSource source : kSources)
    for (unsigned threads : {1u, 2u}) {
      SCOPED_TRACE((source == NeighbourSource::nearest ? "nearest " : "delaunay ") + std::to_string(threads));
      const ThreadLimit limit(threads);
      expect_same_diagram(diagram_of(surface, seeds, source), reference);
    }
  // An object that has seen other seeds, fewer and more of them.
  RestrictedVoronoi used(surface);
  Diagram last;
  used.evaluate(random_seeds(mesh, 50, 27), NeighbourSource::nearest, Want::moments, last);
  for (NeighbourSource source : kSources) expect_same_diagram(diagram_of(used, seeds, source), reference);
  used.evaluate(random_seeds(mesh, 6000, 28), NeighbourSource::delaunay, Want::moments, last);
  used.evaluate(seeds, NeighbourSource::nearest, Want::moments, last);
  expect_same_moments(last.moments, reference.moments);
}

// Of polygons by their labels, with a density and without, where no exact arithmetic is needed.
TEST_P(Medium, MomentsInBatchesAreThoseOfTheClipper) {
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(1.5 + std::sin(v.x + 2 * v.y));
  for (const Surface& surface : {Surface(mesh), Surface(mesh, density)}) {
    const RestrictedPolygons polygons = diagram_of(surface, seeds, NeighbourSource::nearest).polygons;
    const SortedSeeds sorted = sort_seeds(seeds);
    Clipper clipper;
    clipper.reset(sorted);
    const std::size_t count = polygons.pairs.size();
    std::vector<Moments> expected, found(count);
    std::vector<char> known(count, 0);
    PolygonBatches<std::size_t> batches;
    batches.begin(surface, sorted);
    const auto take = [&](const auto& batch) {
      for (std::size_t lane = 0; lane < batch.filled; ++lane) {
        found[batch.items[lane]] = batch.numbers.moments(lane);
        known[batch.items[lane]] = batch.numbers.fits[lane] > 0;
      }
    };
    for (std::size_t p = 0; p < count; ++p) {
      std::vector<Index> labels(polygons.labels.begin() + static_cast<std::ptrdiff_t>(polygons.offsets[p]),
                                polygons.labels.begin() + static_cast<std::ptrdiff_t>(polygons.offsets[p + 1]));
      for (Index& label : labels)
        if (!is_edge(label)) label = sorted.slot[label];
      const Index facet = surface.facet_of[polygons.pairs[p].triangle], slot = sorted.slot[polygons.pairs[p].cell];
      clipper.begin(surface, facet);
      clipper.take(slot, labels.data(), labels.size());
      expected.push_back(clipper.integrate());
      if (batches.takes(labels.size())) batches.add(facet, slot, labels, p, take);
    }
    batches.finish(take);
    for (std::size_t p = 0; p < count; ++p) {
      if (known[p]) {
        ASSERT_TRUE(same_bits(found[p], expected[p])) << p;
      }
    }
    // Whole facets always are.
    for (std::size_t p = 0; p < count; ++p) {
      const auto labels =
          std::span(polygons.labels).subspan(polygons.offsets[p], polygons.offsets[p + 1] - polygons.offsets[p]);
      if (std::ranges::all_of(labels, is_edge)) {
        EXPECT_TRUE(known[p]);
      }
    }
  }
}

// The optimiser's use: seeds that move a little, or jump, change their number, coincide, and come back.
TEST_P(Medium, AUsedObjectAnswersAsAFreshOne) {
  const Surface surface(mesh);
  const double size = bounding_box(mesh.vertices).diagonal();
  RestrictedVoronoi used(surface);
  SplitMix64 random(35);
  std::vector<Vec3> moving = seeds;
  for (int step = 0; step < 9; ++step) {
    const double reach = step % 3 == 2 ? 0.1 : std::pow(10, -2.0 - step);
    for (Vec3& x : moving)
      if (step % 4 || random.below(4) == 0)
        x += reach * size * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    if (step == 3) moving.resize(moving.size() - moving.size() / 3);
    if (step == 5) moving.push_back(moving[0]);
    if (step == 6)
      std::fill(moving.begin(), moving.begin() + static_cast<std::ptrdiff_t>(moving.size() / 2), moving[0]);
    if (step == 7) moving = seeds;
    const NeighbourSource source = kSources[step == 4];
    Diagram of_used, of_fresh;
    used.evaluate(moving, source, Want::moments, of_used);
    RestrictedVoronoi(surface).evaluate(moving, source, Want::moments, of_fresh);
    const CellMoments &got = of_used.moments, &want = of_fresh.moments;
    SCOPED_TRACE(step);
    expect_same_moments(got, want);
    EXPECT_TRUE(same_bits(got.step_mass, want.step_mass));
    EXPECT_NEAR(got.mass, surface.mass, 1e-12 * surface.mass);
    if (HasFailure()) return;
  }
}

// Step masses steer the optimiser, so they may not depend on the source either.
TEST_P(Medium, StepMassesAreTheSameForBothSources) {
  const Surface surface(mesh);
  Diagram nearest, delaunay;
  RestrictedVoronoi(surface).evaluate(seeds, NeighbourSource::nearest, Want::moments, nearest);
  RestrictedVoronoi(surface).evaluate(seeds, NeighbourSource::delaunay, Want::moments, delaunay);
  EXPECT_TRUE(same_bits(nearest.moments.step_mass, delaunay.moments.step_mass));
}

TEST_P(Medium, CertificationIsReproducible) {
  const Surface surface(mesh);
  for (NeighbourSource source : kSources) {
    PairCounts first;
    for (unsigned threads : {1u, 2u}) {
      const ThreadLimit limit(threads);
      Diagram diagram;
      const PairCounts again = RestrictedVoronoi(surface).evaluate(seeds, source, Want::moments, diagram).counts;
      if (first.pairs == 0) first = again;
      EXPECT_EQ(again.pairs, first.pairs);
      EXPECT_EQ(again.uncertain, first.uncertain);
      EXPECT_EQ(again.wider, first.wider);
    }
  }
}

void PrintTo(const MediumCase& problem, std::ostream* out) { *out << problem.name; }

INSTANTIATE_TEST_SUITE_P(Restricted, Medium, testing::ValuesIn(medium_cases()),
                         [](const auto& instance) { return test_name(instance.param.name); });

// Lists that were made for earlier positions hold seeds beyond the radius that they still answer for.
TEST(Restricted, FollowsSeedsThatMoveByAFractionOfTheirSpacing) {
  const TriangleMesh mesh = grid_patch(40, 30);
  const Surface surface(mesh);
  for (std::uint64_t trial = 0; trial < 6; ++trial) {
    SplitMix64 random(trial);
    RestrictedVoronoi used(surface);
    std::vector<Vec3> seeds = random_seeds(mesh, 5000, trial);
    for (int step = 0; step < 4; ++step) {
      SCOPED_TRACE("trial " + std::to_string(trial) + ", step " + std::to_string(step));
      const Diagram d = diagram_of(used, seeds, NeighbourSource::nearest);
      expect_sound(surface, d);
      expect_same_diagram(d, diagram_of(surface, seeds, NeighbourSource::nearest));
      if (HasFailure()) return;
      for (Vec3& x : seeds) x += 0.05 * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    }
  }
}

// Blocks of 32, the blocks' sums likewise: what devices and ranks do as well.
TEST(Restricted, CellsAreSummedByTheRuleOfAllSums) {
  SplitMix64 random(12);
  for (const std::size_t count : {1, 32, 33, 100, 1024, 1025, 5000}) {
    std::vector<Moments> terms(count);
    FixedTreeSum sum;
    for (Moments& term : terms) {
      term = {random.range(0, 1), {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)}, random.range(0, 1)};
      sum.add(term);
    }
    EXPECT_TRUE(same_bits(sum.finish(), fixed_sum<Moments>(count, [&](std::size_t k) { return terms[k]; }))) << count;
  }
}

// The first of two seeds that have met has the cell of both.
TEST(Restricted, SeedsThatMeetOnTheirWay) {
  const TriangleMesh mesh = grid_patch(20, 20);
  const Surface surface(mesh);
  RestrictedVoronoi used(surface);
  std::vector<Vec3> seeds = random_seeds(mesh, 400, 3);
  diagram_of(used, seeds, NeighbourSource::nearest);
  std::array<std::size_t, 2> nearest{0, 1};
  for (std::size_t j = 1; j < seeds.size(); ++j)
    for (std::size_t i = 0; i < j; ++i)
      if (norm2(seeds[j] - seeds[i]) < norm2(seeds[nearest[1]] - seeds[nearest[0]])) nearest = {i, j};
  const Vec3 middle = 0.5 * (seeds[nearest[0]] + seeds[nearest[1]]);
  for (const std::size_t i : nearest) seeds[i] = middle;
  const Diagram d = diagram_of(used, seeds, NeighbourSource::nearest);
  EXPECT_EQ(d.moments.cells[nearest[1]].mass, 0);
  expect_same_diagram(d, diagram_of(surface, seeds, NeighbourSource::nearest));
}

// Across a needle the density rises so steeply that beyond the needle, where rounding puts positions, it would be
// anything.
TEST(Restricted, DensitiesOnNeedlesAreThoseOfTheirCorners) {
  TriangleMesh mesh;
  mesh.vertices = {{-0.6, 0, 0}, {0.7, 0, 0}, {0.1, 1e-30, 0}, {0, -1, 0.3}};
  mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
  const Surface surface(mesh, {1, 1, 2, 1});
  for (std::uint64_t trial = 0; trial < 20; ++trial) {
    SCOPED_TRACE(trial);
    expect_sound(surface, diagram_of(surface, random_seeds(mesh, 40, trial), NeighbourSource::nearest));
  }
}

// Facets that stay divided as they were are certified vertex by vertex and computed several polygons at a time.
// Whatever happens to the seeds, and whatever instructions are used, no bit may differ from a diagram that knows
// nothing.
TEST(Restricted, WhatIsKnownOfFacetsChangesNoBit) {
  struct Case {
    const char* name;
    TriangleMesh mesh;
    std::size_t seeds;
  };
  const Case cases[] = {{"facets smaller than cells", torus(96, 48), 700},
                        {"facets larger than cells", icosphere(2), 3000},
                        {"about the same, flat", grid_patch(30, 20), 900},
                        {"sheets without neighbours", soup(60, 5), 500}};
  for (const Case& c : cases)
    for (const bool uniform : {true, false}) {
      std::vector<double> density;
      if (!uniform)
        for (const Vec3& p : c.mesh.vertices) density.push_back(1.5 + std::sin(3 * p.x) * std::cos(2 * p.y + p.z));
      const Surface surface(c.mesh, density);
      const double spacing = std::sqrt(surface.area / static_cast<double>(c.seeds));
      std::array<std::unique_ptr<RestrictedVoronoi>, 3> used;
      for (auto& voronoi : used) voronoi = std::make_unique<RestrictedVoronoi>(surface);
      SplitMix64 random(71);
      const auto somewhere = [&] { return Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)}; };
      std::vector<Vec3> seeds = random_seeds(c.mesh, c.seeds, 72);
      for (int step = 0; step < 30; ++step) {
        SCOPED_TRACE(std::string(c.name) + (uniform ? "" : ", with a density") + ", step " + std::to_string(step));
        const Diagram fresh = diagram_of(surface, seeds, NeighbourSource::nearest);
        for (const LaneSet lanes : {LaneSet::portable, LaneSet::avx2, LaneSet::avx512}) {
          limit_lanes(lanes);
          RestrictedVoronoi& voronoi = *used[static_cast<std::size_t>(lanes)];
          // Known facets are what vertices are told from, too.
          expect_same_diagram(diagram_of(voronoi, seeds, NeighbourSource::nearest), fresh);
        }
        limit_lanes(LaneSet::avx512);
        if (HasFailure()) return;
        // All move, by less and less; or some are thrown to where others are, or put beside them.
        const double reach = spacing * std::pow(10.0, -0.5 * (step % 10));
        if (step % 3 == 0) {
          for (Vec3& x : seeds) x += reach * somewhere();
        } else {
          for (std::size_t k = random.below(10); k < 12; ++k) {
            const Vec3& other = seeds[random.below(seeds.size())];
            seeds[random.below(seeds.size())] = other + reach * somewhere();
          }
        }
      }
    }
}

// What was divided one way is divided another where seeds that all but tie move by units of rounding.
TEST(Restricted, WhatIsKnownOfTiesChangesNoBit) {
  const TriangleMesh mesh = grid_patch(5, 4);
  const Surface surface(mesh);
  SplitMix64 random(81);
  // A grid that is turned, so that its fours of seeds tie but for rounding.
  std::vector<Vec3> grid;
  for (int i = -6; i < 12; ++i)
    for (int j = -6; j < 12; ++j) {
      const Vec3 p{0.31 + 0.48 * i - 0.21 * j, 0.17 + 0.21 * i + 0.48 * j, 0.1};
      if (p.x > -0.5 && p.x < 5.5 && p.y > -0.5 && p.y < 4.5) grid.push_back(p);
    }
  RestrictedVoronoi used(surface);
  for (int step = 0; step < 60; ++step) {
    SCOPED_TRACE(step);
    const double reach = std::pow(10.0, -random.range(13, 17));
    std::vector<Vec3> seeds = grid;
    for (Vec3& x : seeds) x += reach * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    const Diagram d = diagram_of(used, seeds, NeighbourSource::nearest);
    expect_sound(surface, d);
    expect_same_diagram(d, diagram_of(surface, seeds, NeighbourSource::nearest));
    if (HasFailure()) return;
  }
}

// Seeds that stay are recognised where others among them go, come or move, and what bounded their cells is tried first.
TEST(Restricted, FollowsSeedsOfWhichSomeGoAndOthersCome) {
  const TriangleMesh mesh = torus(96, 48);
  const Surface surface(mesh);
  RestrictedVoronoi used(surface);
  std::vector<Vec3> seeds = random_seeds(mesh, 3000, 41);
  SplitMix64 random(42);
  for (int step = 0; step < 12; ++step) {
    SCOPED_TRACE(step);
    const Diagram d = diagram_of(used, seeds, NeighbourSource::nearest);
    expect_sound(surface, d);
    expect_same_diagram(d, diagram_of(surface, seeds, NeighbourSource::nearest));
    if (HasFailure()) return;
    // Single ones, runs, the first and the last, and all but a few.
    const std::size_t most = step % 4 == 3 ? seeds.size() - 40 : step % 4 == 2 ? 60 : 3;
    for (std::size_t changes = random.below(step % 4 == 3 ? 1 : 40) + 1; changes-- > 0;) {
      const std::size_t count = random.below(most) + 1, at = random.below(seeds.size() - count + 1);
      seeds.erase(seeds.begin() + static_cast<std::ptrdiff_t>(at),
                  seeds.begin() + static_cast<std::ptrdiff_t>(at + count));
      if (seeds.size() < 100) break;
    }
    for (int k = 0; k < 30; ++k)
      seeds[random.below(seeds.size())] += 0.02 * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    const std::size_t missing = step % 2 ? 3000 - std::min<std::size_t>(3000, seeds.size()) : random.below(100);
    const std::vector<Vec3> more = random_seeds(mesh, missing + 1, 43 + static_cast<std::uint64_t>(step));
    seeds.insert(seeds.end(), more.begin(), more.end());
    if (step == 8) seeds.insert(seeds.begin() + 7, seeds.back());
  }
}

// --- Moments by quadrature ---

// Six points, exact for polynomials of degree 4 (Dunavant 1985).
template <class F>
void integrate_degree4(const Vec3& a, const Vec3& b, const Vec3& c, double area, const F& add) {
  constexpr double kWeights[2] = {0.223381589678011, 0.109951743655322};
  constexpr double kNear[2] = {0.445948490915965, 0.091576213509771};
  for (int ring = 0; ring < 2; ++ring)
    for (int k = 0; k < 3; ++k) {
      const double w = 1 - 2 * kNear[ring], n = kNear[ring];
      const double u[3] = {k == 0 ? w : n, k == 1 ? w : n, k == 2 ? w : n};
      add(u[0] * a + u[1] * b + u[2] * c, kWeights[ring] * area);
    }
}

// The density at p by the areas that p cuts the triangle into.
double density_at(const Surface& surface, Index triangle, const Vec3& p) {
  const Triangle& t = surface.mesh.triangles[triangle];
  const Vec3 &a = surface.mesh.vertices[t[0]], &b = surface.mesh.vertices[t[1]], &c = surface.mesh.vertices[t[2]];
  const Vec3 n = cross(b - a, c - a);
  const double n2 = norm2(n);
  const double wa = dot(n, cross(b - p, c - p)) / n2, wb = dot(n, cross(c - p, a - p)) / n2;
  return wa * surface.density[t[0]] + wb * surface.density[t[1]] + (1 - wa - wb) * surface.density[t[2]];
}

void expect_quadrature(const Surface& surface, const std::vector<Vec3>& seeds) {
  const Diagram d = diagram_of(surface, seeds, NeighbourSource::nearest);
  expect_sound(surface, d);
  std::vector<Moments> want(seeds.size());
  double reach = 0;
  for (std::size_t k = 0; k < d.polygons.pairs.size(); ++k) {
    const auto [triangle, cell] = d.polygons.pairs[k];
    const std::size_t first = d.polygons.offsets[k], end = d.polygons.offsets[k + 1];
    // From the middle, unlike the library's fans.
    Vec3 middle;
    for (std::size_t e = first; e < end; ++e) middle += d.polygons.vertices[e];
    middle *= 1.0 / static_cast<double>(end - first);
    for (std::size_t e = first; e < end; ++e) {
      const Vec3 &p = d.polygons.vertices[e], &q = d.polygons.vertices[e + 1 == end ? first : e + 1];
      const double area = 0.5 * norm(cross(p - middle, q - middle));
      integrate_degree4(middle, p, q, area, [&](const Vec3& at, double weight) {
        const double mass = weight * (surface.density.empty() ? 1.0 : density_at(surface, triangle, at));
        const Vec3 local = at - seeds[cell];
        want[cell] += {mass, mass * local, mass * norm2(local)};
      });
      reach = std::max(reach, norm(p - seeds[cell]));
    }
  }
  // The rule's constants have 15 digits.
  const double tolerance = 1e-12 * surface.mass;
  double energy = 0;
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const Moments& got = d.moments.cells[i];
    EXPECT_NEAR(got.mass, want[i].mass, tolerance) << "seed " << i;
    EXPECT_LE(norm(got.first - want[i].first), tolerance * reach) << "seed " << i;
    EXPECT_NEAR(got.second, want[i].second, tolerance * reach * reach) << "seed " << i;
    energy += want[i].second;
  }
  EXPECT_NEAR(d.moments.energy, energy, 1e-11 * energy);
}

std::vector<double> varied_density(const TriangleMesh& mesh) {
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(0.125 + std::exp(2 * v.x) + norm2(v));
  return density;
}

struct QuadratureCase {
  const char* name;
  TriangleMesh mesh;
};

TEST(RestrictedMoments, AgreeWithQuadrature) {
  for (const auto& [name, mesh] : std::vector<QuadratureCase>{{"sphere", icosphere(3)},
                                                              {"torus", torus(24, 16)},
                                                              {"patch", wavy_patch(12)},
                                                              {"box", box(2)},
                                                              {"pages", pages()},
                                                              {"needles", needles()},
                                                              {"collinear", collinear_among_good()}}) {
    SCOPED_TRACE(name);
    for (std::size_t count : {1u, 7u, 60u, 900u}) {
      const std::vector<Vec3> seeds = random_seeds(mesh, count, 51);
      expect_quadrature(Surface(mesh), seeds);
      expect_quadrature(Surface(mesh, varied_density(mesh)), seeds);
    }
    expect_quadrature(Surface(mesh, varied_density(mesh)), grid_seeds(mesh, 4, 4, 4));
  }
}

TEST(RestrictedMoments, TheSurfaceMassIsTheIntegralOfTheDensity) {
  const TriangleMesh mesh = torus(24, 16);
  const std::vector<double> density = varied_density(mesh);
  double mass = 0, area = 0;
  for (const Triangle& t : mesh.triangles) {
    const double s = triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
    area += s;
    mass += s * (density[t[0]] + density[t[1]] + density[t[2]]) / 3;
  }
  const Surface surface(mesh, density);
  EXPECT_NEAR(surface.area, area, 1e-13 * area);
  EXPECT_NEAR(surface.mass, mass, 1e-13 * mass);
}

TEST(RestrictedMoments, AConstantDensityScalesThem) {
  const TriangleMesh mesh = torus(24, 16);
  const std::vector<Vec3> seeds = random_seeds(mesh, 100, 52);
  const Surface uniform(mesh), dense(mesh, std::vector<double>(mesh.vertices.size(), 3.0));
  const Diagram one = diagram_of(uniform, seeds, NeighbourSource::nearest);
  const Diagram three = diagram_of(dense, seeds, NeighbourSource::nearest);
  EXPECT_TRUE(one.polygons.labels == three.polygons.labels);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    EXPECT_NEAR(three.moments.cells[i].mass, 3 * one.moments.cells[i].mass, 1e-13 * dense.mass);
    EXPECT_NEAR(three.moments.cells[i].second, 3 * one.moments.cells[i].second, 1e-13 * dense.mass);
  }
}

TEST(RestrictedMoments, StepMassesAreAtLeastTheMassesAndPositiveBesideMass) {
  const TriangleMesh mesh = icosphere(3);
  const Surface surface(mesh);
  std::vector<Vec3> seeds = random_seeds(mesh, 300, 53);
  for (Vec3 x : random_seeds(mesh, 20, 54)) seeds.push_back(0.1 * x);  // own nothing or little
  const Diagram d = diagram_of(surface, seeds, NeighbourSource::nearest);
  ASSERT_EQ(d.moments.step_mass.size(), seeds.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) EXPECT_GE(d.moments.step_mass[i], d.moments.cells[i].mass);
}

// The corners are not collinear, but the products that make up the area round to the same.
TEST(Surface, TakesFacetsWhoseAreaRoundsToNothing) {
  constexpr double e = 0x1p-30;
  TriangleMesh mesh{{{0, 0, 0}, {1 + e, 1, 0}, {1, 1 - e, 0}, {0, 0, 1}}, {{0, 1, 2}, {0, 2, 3}}, {}};
  ASSERT_EQ(twice_area_normal(mesh.vertices[0], mesh.vertices[1], mesh.vertices[2]), Vec3{});
  const Surface surface(mesh, {1, 2, 3, 4});
  ASSERT_EQ(surface.facets.size(), 2u);
  const Diagram diagram = diagram_of(surface, {{0, 0, 0.3}, {0.6, 0.6, 0}}, NeighbourSource::nearest);
  EXPECT_NEAR(diagram.moments.mass, surface.mass, 1e-12 * surface.mass);
}

TEST(Surface, RejectsWhatItCannotIntegrate) {
  EXPECT_THROW(Surface(TriangleMesh{}), Error);
  EXPECT_THROW(Surface({{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {{0, 1, 2}}, {}}), Error);
  for (double bad : {0.0, -1.0, std::nan(""), HUGE_VAL})
    EXPECT_THROW(Surface(single_triangle(), {1, bad, 1}), Error) << bad;
  EXPECT_THROW(Surface(single_triangle(), {1, 1}), Error);
}

// Needles in every direction and far from the origin: areas must not be lost to cancellation.
TEST(Restricted, CoversARotatedRodOfLongTriangles) {
  constexpr int kSides = 24;
  const Vec3 along{2 / 3.0, 2 / 3.0, 1 / 3.0}, u{-2 / 3.0, 1 / 3.0, 2 / 3.0}, v = cross(along, u);
  for (double length : {10.0, 1e3}) {
    TriangleMesh mesh;
    for (int end = 0; end < 2; ++end)
      for (int k = 0; k < kSides; ++k) {
        const double phi = 2 * std::numbers::pi * k / kSides;
        mesh.vertices.push_back(Vec3{3, 5, 7} + end * length * along + std::cos(phi) * u + std::sin(phi) * v);
      }
    for (Index k = 0; k < kSides; ++k) {
      const Index next = (k + 1) % kSides;
      mesh.triangles.push_back({k, next, kSides + next});
      mesh.triangles.push_back({k, kSides + next, kSides + k});
    }
    SCOPED_TRACE(length);
    const Surface surface(mesh);
    for (std::size_t count : {10u, 1000u}) {
      const std::vector<Vec3> seeds = random_seeds(mesh, count, 55);
      const Diagram d = diagram_of(surface, seeds, NeighbourSource::nearest);
      expect_sound(surface, d);
      expect_same_diagram(diagram_of(surface, seeds, NeighbourSource::delaunay), d);
    }
  }
}

// Distances whose squares nearly leave the range of double.
TEST(Restricted, SeedsMayBeAsCloseAsTheRangeAllows) {
  const TriangleMesh mesh = grid_patch(2, 2);
  const Surface surface(mesh);
  for (double e : {1e-20, 1e-100, 1e-150}) {
    const std::vector<Vec3> seeds{{1, 1, 0}, {0, 0, 0}, {e, 0, 0}, {0, e, 0}, {0, 0, e}};
    SCOPED_TRACE(e);
    for (NeighbourSource source : kSources) expect_sound(surface, diagram_of(surface, seeds, source));
  }
}

// All cells meet on the surface, seen from ever farther away.
TEST(Restricted, SeedsMayBeFarAway) {
  const TriangleMesh mesh = icosphere(4);
  const Surface surface(mesh);
  for (double distance : {10.0, 1e3, 1e4}) {
    std::vector<Vec3> seeds = round_seeds(100, false);
    for (Vec3& x : seeds) x = (distance / 0.75) * (x - Vec3{0.5, 0.5, 0.25});
    SCOPED_TRACE(distance);
    const Diagram d = diagram_of(surface, seeds, NeighbourSource::nearest);
    expect_sound(surface, d);
    expect_same_diagram(diagram_of(surface, seeds, NeighbourSource::delaunay), d);
  }
}

// --- Definition, on points ---

// Random points of the surface belong to a pair with their nearest seed.
TEST(Restricted, NearestSeedsOfRandomPointsArePairs) {
  const TriangleMesh mesh = torus(60, 40);
  const Surface surface(mesh);
  const std::vector<Vec3> seeds = random_seeds(mesh, 2000, 61);
  const auto pairs = pairs_of(diagram_of(surface, seeds, NeighbourSource::nearest).polygons);
  SplitMix64 random(62);
  for (int sample = 0; sample < 5000; ++sample) {
    const auto t = static_cast<Index>(random.below(mesh.triangles.size()));
    double r = random.unit(), s = random.unit();
    if (r + s > 1) r = 1 - r, s = 1 - s;
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3 p =
        mesh.vertices[a] + r * (mesh.vertices[b] - mesh.vertices[a]) + s * (mesh.vertices[c] - mesh.vertices[a]);
    Index owner = 0;
    double best = norm2(p - seeds[0]), second = HUGE_VAL;
    for (Index i = 1; i < seeds.size(); ++i) {
      const double d = norm2(p - seeds[i]);
      if (d < best) second = best, best = d, owner = i;
      else second = std::min(second, d);
    }
    if (second - best < 1e-10) continue;
    EXPECT_TRUE(std::binary_search(pairs.begin(), pairs.end(), std::array<Index, 2>{t, owner})) << t << " " << owner;
  }
}

// --- The shared models ---

enum class SeedKind { ten, thousand, ten_thousand, vertices, grid };
struct ModelCase {
  const char* model;
  SeedKind kind;
};

class Model : public testing::TestWithParam<ModelCase> {};

TEST_P(Model, BothSourcesGiveTheSameDiagram) {
  const auto& [model, kind] = GetParam();
  const std::string path = shared_model(model);
  if (path.empty()) GTEST_SKIP() << "no shared data";
  const TriangleMesh mesh = read_mesh(path);
  const Surface surface(mesh);
  std::vector<Vec3> seeds;
  switch (kind) {
    case SeedKind::ten: seeds = random_seeds(mesh, 10, 71); break;
    case SeedKind::thousand: seeds = random_seeds(mesh, 1000, 72); break;
    case SeedKind::ten_thousand: seeds = random_seeds(mesh, 10000, 73); break;
    case SeedKind::vertices: seeds = vertex_seeds(mesh); break;
    case SeedKind::grid: seeds = grid_seeds(mesh, 22, 22, 22); break;
  }
  const Diagram nearest = diagram_of(surface, seeds, NeighbourSource::nearest);
  expect_sound(surface, nearest);
  expect_same_diagram(diagram_of(surface, seeds, NeighbourSource::delaunay), nearest);
}

std::vector<ModelCase> model_cases() {
  std::vector<ModelCase> cases;
  for (const char* model : {"bunny.off", "anchor.off", "beetle.obj", "camel.off", "elephant.off", "face.obj",
                            "fandisk.off", "homer.obj", "igea.ply"})
    for (SeedKind kind :
         {SeedKind::ten, SeedKind::thousand, SeedKind::ten_thousand, SeedKind::vertices, SeedKind::grid})
      cases.push_back({model, kind});
  return cases;
}

std::string model_case_name(const testing::TestParamInfo<ModelCase>& instance) {
  constexpr const char* kNames[] = {"10", "1000", "10000", "vertices", "grid"};
  return test_name(std::string(instance.param.model) + "_" + kNames[static_cast<int>(instance.param.kind)]);
}

INSTANTIATE_TEST_SUITE_P(Restricted, Model, testing::ValuesIn(model_cases()), model_case_name);

}  // namespace
}  // namespace bisector::test
