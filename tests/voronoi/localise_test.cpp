// Cells without their stray parts: labels stay those of a division of every facet, and the dual follows the surface.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "backend/cpu_backend.h"
#include "support/diagram.h"
#include "support/featured.h"
#include "support/run.h"
#include "voronoi/ball_property.h"
#include "voronoi/localise.h"

namespace bisector::test {
namespace {

// On every triangle a cell has one polygon, no label twice and none of its own; cells that are labels of each
// other are so from both sides.
void expect_division(const RestrictedPolygons& polygons) {
  std::map<Index, std::map<Index, std::set<Index>>> labels;  // by triangle and cell
  for (std::size_t k = 0; k < polygons.pairs.size(); ++k) {
    const auto [triangle, cell] = polygons.pairs[k];
    if (k > 0) {
      const RestrictedPolygons::Pair& last = polygons.pairs[k - 1];
      ASSERT_TRUE(last.triangle < triangle || (last.triangle == triangle && last.cell < cell));
    }
    const std::size_t first = polygons.offsets[k], size = polygons.offsets[k + 1] - first;
    ASSERT_GE(size, 2u);
    std::set<Index> own{cell};
    for (std::size_t e = 0; e < size; ++e) {
      const Index label = polygons.labels[first + e];
      EXPECT_TRUE(own.insert(label).second);
      if (!is_edge(label)) labels[triangle][cell].insert(label);
    }
  }
  for (const auto& [triangle, cells] : labels)
    for (const auto& [cell, others] : cells)
      for (const Index other : others) {
        ASSERT_TRUE(cells.contains(other));
        EXPECT_TRUE(cells.at(other).contains(cell));
      }
}

std::vector<Vec3> optimised_plate_seeds(const Surface& surface, std::uint64_t random_seed) {
  CpuBackend backend(surface, NeighbourSource::nearest);
  OptimiseOptions options;
  options.iterations = 20;
  return optimised_seeds(backend, random_seeds(surface.mesh, 300, random_seed), options);
}

TEST(LocalisedCells, AreTheCellsWhereTheseAreDisks) {
  const TriangleMesh sphere = icosphere(3);
  const Surface surface(sphere);
  const std::vector<Vec3> seeds = random_seeds(sphere, 200, 3);
  const Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
  RestrictedPolygons localised = diagram.polygons;
  EXPECT_EQ(localise_cells(surface, seeds, localised), 0u);
  EXPECT_EQ(localised.labels, diagram.polygons.labels);
  EXPECT_TRUE(same_bits(localised.vertices, diagram.polygons.vertices));
}

// Seeds on both sides of a plate own pieces of the other side, wherever the two sides are not sampled alike.
TEST(LocalisedCells, OfAPlateAreDisksOnOneSide) {
  std::size_t moved = 0;
  for (const double thickness : {0.05, 0.02}) {
    TriangleMesh plate = box(16);
    for (Vec3& v : plate.vertices) v.z *= thickness;
    const Surface surface(plate);
    for (std::uint64_t random_seed = 1; random_seed < 6; ++random_seed) {
      const std::vector<Vec3> seeds = optimised_plate_seeds(surface, random_seed);
      Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
      const BallReport before = check_ball_property(surface, diagram.polygons);
      EXPECT_FALSE(before.holds);
      moved += localise_cells(surface, seeds, diagram.polygons);
      expect_division(diagram.polygons);
      const BallReport after = check_ball_property(surface, diagram.polygons);
      EXPECT_LT(8 * after.failures(), before.failures());
      EXPECT_EQ(after.euler, 2);
    }
  }
  EXPECT_GT(moved, 100u);
}

// The dual of a wedge's raw cells has caves and bubbles along the edge; that of the localised ones is its surface.
TEST(LocalisedCells, OfAWedgeHaveItsSurfaceAsDual) {
  for (const double angle : {0.5, 0.35}) {
    const TriangleMesh mesh = wedge(angle);
    const Surface surface(mesh);
    const std::vector<Vec3> seeds = random_seeds(mesh, 400, 11);
    Diagram diagram = diagram_of(surface, seeds, NeighbourSource::nearest);
    const std::size_t before = check_ball_property(surface, diagram.polygons).failures();
    localise_cells(surface, seeds, diagram.polygons);
    expect_division(diagram.polygons);
    const BallReport after = check_ball_property(surface, diagram.polygons);
    EXPECT_LT(2 * after.failures(), before);
    EXPECT_EQ(after.euler, 2);
  }
}

}  // namespace
}  // namespace bisector::test
