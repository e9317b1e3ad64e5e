// Cells without their stray parts tile the surface as before, and on sheets apart they are those of each sheet alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "backend/cpu_backend.h"
#include "core/parallel.h"
#include "support/diagram.h"
#include "support/featured.h"
#include "support/run.h"
#include "voronoi/ball_property.h"
#include "voronoi/localise.h"
#include "voronoi/polygons.h"
#include "voronoi/tiling.h"

namespace bisector::test {
namespace {

// Polygons tile the surface, and the moments are theirs.
void expect_diagram(const Surface& surface, const Diagram& diagram) {
  EXPECT_EQ(count_untiled(surface, diagram.polygons), 0u);
  EXPECT_NEAR(diagram.moments.mass, surface.mass, 1e-12 * surface.mass);
  std::vector<double> areas(diagram.moments.cells.size(), 0);
  std::vector<std::vector<Index>> triangles(areas.size());
  for (std::size_t p = 0; p < diagram.polygons.pairs.size(); ++p) {
    const auto [triangle, cell] = diagram.polygons.pairs[p];
    areas[cell] += polygon_area(diagram.polygons, p);
    triangles[cell].push_back(triangle);
  }
  const Csr<Index>& listed = diagram.moments.triangles;
  ASSERT_EQ(listed.rows(), areas.size());
  for (std::size_t i = 0; i < areas.size(); ++i) {
    EXPECT_NEAR(diagram.moments.cells[i].mass, areas[i], 1e-12 * surface.mass);
    EXPECT_EQ(triangles[i], std::vector<Index>(listed.begin(i), listed.end(i)));
  }
}

std::vector<Vec3> optimised_plate_seeds(const Surface& surface, std::uint64_t random_seed) {
  CpuBackend backend(surface, NeighbourSource::nearest);
  OptimiseOptions options;
  options.iterations = 20;
  return optimised_seeds(backend, random_seeds(surface.mesh, 300, random_seed), options);
}

// Nothing is stray, and nothing changes.
void expect_all_are_disks(const TriangleMesh& mesh, std::size_t count) {
  const Surface surface(mesh);
  const std::vector<Vec3> seeds = random_seeds(mesh, count, 3);
  const Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
  Diagram localised = diagram;
  EXPECT_EQ(Localiser(surface).localise(seeds, localised), 0u);
  EXPECT_EQ(localised.polygons.labels, diagram.polygons.labels);
  EXPECT_TRUE(same_bits(localised.polygons.vertices, diagram.polygons.vertices));
  EXPECT_TRUE(same_bits(localised.moments.cells, diagram.moments.cells));
}

TEST(LocalisedCells, AreTheCellsWhereTheseAreDisks) { expect_all_are_disks(icosphere(3), 200); }

// Triangles that meet in a row of collinear ones are neighbours, however many there are of these.
TEST(LocalisedCells, GoOnBehindCollinearTriangles) {
  constexpr Index kPoints = 600;
  TriangleMesh plate;
  plate.vertices = {{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  plate.triangles = {{0, 1, 2}};
  Index last = 0;
  for (Index k = 1; k <= kPoints; ++k) {
    const Index next = k == kPoints ? 1 : static_cast<Index>(plate.vertices.size());
    if (next != 1) plate.vertices.push_back({-1 + 2.0 * k / kPoints, 0, 0});
    if (last != 0) plate.triangles.push_back({0, last, next});
    plate.triangles.push_back({next, last, 3});
    last = next;
  }
  expect_all_are_disks(plate, 60);
}

// Two sheets that are not joined: on each the diagram is that of the seeds on it alone, with triangles smaller than the
// cells, and such as hold a dozen of them.
TEST(LocalisedCells, OfTwoSheetsAreThoseOfEachSheetAlone) {
  for (const auto& [squares, distance] :
       {std::pair{9, 0.2}, {9, 0.05}, {9, 0.01}, {2, 0.2}, {2, 0.05}, {1, 0.2}, {1, 0.05}, {1, 0.01}}) {
    const TriangleMesh lower = grid_patch(squares, squares);
    TriangleMesh upper = lower;
    for (Vec3& v : upper.vertices) v.z += squares * distance;
    TriangleMesh both = lower;
    both.vertices.insert(both.vertices.end(), upper.vertices.begin(), upper.vertices.end());
    const auto first = static_cast<Index>(lower.vertices.size());
    for (const Triangle& t : upper.triangles) both.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    const std::vector<Vec3> below = random_seeds(lower, 40, 5), above = random_seeds(upper, 60, 6);
    std::vector<Vec3> seeds = below;
    seeds.insert(seeds.end(), above.begin(), above.end());

    const Surface surface(both), surface_below(lower), surface_above(upper);
    Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
    EXPECT_GT(Localiser(surface).localise(seeds, diagram), 0u);
    expect_diagram(surface, diagram);
    const Diagram parts[2] = {diagram_of(surface_below, below, NeighbourSource::nearest),
                              diagram_of(surface_above, above, NeighbourSource::nearest)};
    RestrictedPolygons expected = parts[0].polygons;
    for (std::size_t p = 0; p < parts[1].polygons.pairs.size(); ++p) {
      const auto [triangle, cell] = parts[1].polygons.pairs[p];
      expected.pairs.push_back({triangle + static_cast<Index>(lower.triangles.size()), cell + 40});
      for (std::size_t e = parts[1].polygons.offsets[p]; e < parts[1].polygons.offsets[p + 1]; ++e) {
        const Index label = parts[1].polygons.labels[e];
        expected.labels.push_back(is_edge(label) ? label : label + 40);
      }
      expected.offsets.push_back(expected.labels.size());
    }
    ASSERT_EQ(diagram.polygons.pairs.size(), expected.pairs.size());
    for (std::size_t p = 0; p < expected.pairs.size(); ++p) {
      EXPECT_EQ(diagram.polygons.pairs[p].triangle, expected.pairs[p].triangle);
      EXPECT_EQ(diagram.polygons.pairs[p].cell, expected.pairs[p].cell);
    }
    EXPECT_EQ(diagram.polygons.labels, expected.labels);
    EXPECT_NEAR(diagram.moments.energy, parts[0].moments.energy + parts[1].moments.energy,
                1e-12 * diagram.moments.energy);
  }
}

// A seed whose neighbours in space are all on the other sheet has others on its own, far beyond them.
TEST(LocalisedCells, BesideAClusterOnTheOtherSheetTileIt) {
  const TriangleMesh lower = grid_patch(9, 9);
  const auto first = static_cast<Index>(lower.vertices.size());
  const Vec3 up{0, 0, 0.03};
  TriangleMesh sheets = lower;
  for (const Vec3& v : lower.vertices) sheets.vertices.push_back(v + up);
  for (const Triangle& t : lower.triangles) sheets.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  std::vector<Vec3> seeds = random_seeds(lower, 60, 5);
  const std::vector<Vec3> beneath = seeds;
  for (const Vec3& x : random_seeds(lower, 60, 6)) seeds.push_back(x + up);
  for (Index near = 0; near < 60; near += 20)
    for (int k = 0; k < 60; ++k)
      seeds.push_back(beneath[near] + up + 0.007 * std::sqrt(k) * Vec3{std::cos(2.4 * k), std::sin(2.4 * k), 0});
  const Surface surface(sheets);
  Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
  EXPECT_GT(Localiser(surface).localise(seeds, diagram), 0u);
  expect_diagram(surface, diagram);
}

// A sheet without a seed of its own keeps the cells of the sheet across.
TEST(LocalisedCells, OfASheetWithoutSeedStay) {
  TriangleMesh mesh = grid_patch(5, 5);
  const auto first = static_cast<Index>(mesh.vertices.size());
  const std::size_t triangles = mesh.triangles.size();
  const std::vector<Vec3> seeds = random_seeds(mesh, 20, 5);
  for (Index v = 0; v < first; ++v) mesh.vertices.push_back(mesh.vertices[v] + Vec3{0, 0, 0.1});
  for (std::size_t t = 0; t < triangles; ++t) {
    const Triangle v = mesh.triangles[t];
    mesh.triangles.push_back({v[0] + first, v[1] + first, v[2] + first});
  }
  const Surface surface(mesh);
  const Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
  Diagram localised = diagram;
  Localiser(surface).localise(seeds, localised);
  EXPECT_EQ(localised.polygons.labels, diagram.polygons.labels);
}

// Seeds on both sides of a plate own pieces of the other side, wherever the two sides are not sampled alike.
TEST(LocalisedCells, OfAPlateAreDisksOnOneSide) {
  for (const double thickness : {0.05, 0.02}) {
    TriangleMesh plate = box(16);
    for (Vec3& v : plate.vertices) v.z *= thickness;
    const Surface surface(plate);
    Localiser localiser(surface);
    for (std::uint64_t random_seed = 1; random_seed < 6; ++random_seed) {
      const std::vector<Vec3> seeds = optimised_plate_seeds(surface, random_seed);
      Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
      const BallReport before = check_ball_property(surface, diagram.polygons);
      EXPECT_FALSE(before.holds);
      EXPECT_GT(localiser.localise(seeds, diagram), 0u);
      expect_diagram(surface, diagram);
      const BallReport after = check_ball_property(surface, diagram.polygons);
      for (const BallReport::Cell& cell : after.cells) EXPECT_EQ(cell.components, 1u);
      EXPECT_LT(8 * after.failures(), before.failures());
      EXPECT_EQ(after.euler, 2);
    }
  }
}

// The dual of a wedge's raw cells has caves and bubbles along the edge; that of the localised ones is its surface.
TEST(LocalisedCells, OfAWedgeHaveItsSurfaceAsDual) {
  for (const double angle : {0.5, 0.35}) {
    const TriangleMesh mesh = wedge(angle);
    const Surface surface(mesh);
    const std::vector<Vec3> seeds = random_seeds(mesh, 400, 11);
    Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
    const std::size_t before = check_ball_property(surface, diagram.polygons).failures();
    Localiser(surface).localise(seeds, diagram);
    expect_diagram(surface, diagram);
    const BallReport after = check_ball_property(surface, diagram.polygons);
    EXPECT_LT(2 * after.failures(), before);
    EXPECT_EQ(after.euler, 2);
  }
}

// The sides of a lens that is much thinner than its cells are wide: where the seeds of one are sparse, pieces of dozens
// of cells of the other lie behind each other.
TEST(LocalisedCells, OfAThinLensComeToAnEnd) {
  for (const double thickness : {0.02, 0.005}) {
    TriangleMesh lens = icosphere(4);
    for (Vec3& v : lens.vertices) v.z *= thickness;
    const Surface surface(lens);
    for (std::uint64_t random_seed = 1; random_seed < 4; ++random_seed) {
      const std::vector<Vec3> seeds = optimised_plate_seeds(surface, random_seed);
      Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
      const std::size_t before = check_ball_property(surface, diagram.polygons).failures();
      EXPECT_GT(Localiser(surface).localise(seeds, diagram), 0u);
      expect_diagram(surface, diagram);
      const BallReport after = check_ball_property(surface, diagram.polygons);
      EXPECT_LT(4 * after.failures(), before);
      EXPECT_EQ(after.euler, 2);
    }
  }
}

// Of sheets that cross, every cell has pieces of several, and behind each piece is another cell's.
TEST(LocalisedCells, OfManyCrossingSheetsAreOfOneEach) {
  const TriangleMesh sheet = grid_patch(12, 12);
  TriangleMesh sheets;
  for (int k = 0; k < 40; ++k) {
    const auto first = static_cast<Index>(sheets.vertices.size());
    for (const Vec3& v : sheet.vertices)
      sheets.vertices.push_back(v + Vec3{0, 0, 0.02 * std::sin(3.0 * k) * (v.x - 6) + 0.02 * std::cos(5.0 * k) * v.y});
    for (const Triangle& t : sheet.triangles) sheets.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  const Surface surface(sheets);
  const std::vector<Vec3> seeds = random_seeds(sheets, 400, 5);
  const Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
  const auto divided_cells = [&](const Diagram& d) {
    std::size_t count = 0;
    for (const BallReport::Cell& cell : check_ball_property(surface, d.polygons).cells) count += cell.components > 1;
    return count;
  };
  Diagram localised = diagram;
  EXPECT_GT(Localiser(surface).localise(seeds, localised), 390u);
  expect_diagram(surface, localised);
  EXPECT_GT(divided_cells(diagram), 390u);
  EXPECT_LT(divided_cells(localised), 4u);
}

TEST(LocalisedCells, AreTheSameWithAnyNumberOfThreads) {
  const TriangleMesh mesh = wedge(0.35);
  const Surface surface(mesh);
  const std::vector<Vec3> seeds = random_seeds(mesh, 400, 11);
  const Diagram raw = diagram_of(surface, seeds, NeighbourSource::nearest);
  Diagram all = raw, one = raw;
  Localiser(surface).localise(seeds, all);
  const ThreadLimit limit(1);
  Localiser(surface).localise(seeds, one);
  EXPECT_EQ(all.polygons.labels, one.polygons.labels);
  EXPECT_TRUE(same_bits(all.moments.cells, one.moments.cells));
  EXPECT_TRUE(same_bits(all.moments.step_mass, one.moments.step_mass));
}

}  // namespace
}  // namespace bisector::test
