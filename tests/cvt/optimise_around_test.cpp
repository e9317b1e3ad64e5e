// Optimising around a change: as good there as optimising everything, and nothing else moves.
#include "cvt/optimise_around.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "backend/cpu_backend.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "cvt/multilevel.h"
#include "support/models.h"
#include "support/optimised.h"
#include "support/run.h"

namespace bisector::test {
namespace {

constexpr std::size_t kSeeds = 1500;

// Optimised seeds on a fine surface.
struct Settled {
  explicit Settled(const TriangleMesh& mesh, std::vector<double> density = {})
      : surface(mesh, std::move(density)), backend(surface, NeighbourSource::nearest),
        free(backend, initial_seeds(surface, kSeeds, 7)) {
    options.constrained = true;
    options.tolerance = 0;
    options.iterations = 100;
    optimise(free.run, options);
    options.iterations = 60;
  }
  CvtRun& run() { return free.run; }

  Surface surface;
  CpuBackend backend;
  FreeRun free;
  OptimiseOptions options;
};

// Removes a seed, adds one at the other end of the surface, and pushes a third.
void disturb(PlacedSeeds& seeds) {
  const Vec3 far = -1.0 * seeds.position(0);
  seeds.edit_positions()[300] += 0.4 * (seeds.position(301) - seeds.position(300));
  seeds.remove(std::vector<Index>{0});
  seeds.add(1.001 * far);
}

double largest(const std::vector<Vec3>& vectors, const std::vector<Index>& of) {
  double most = 0;
  for (const Index i : of) most = std::max(most, norm(vectors[i]));
  return most;
}

TEST(OptimiseAround, SettlesWhatChangedAndMovesNothingElse) {
  TriangleMesh sphere = icosphere(5);
  std::vector<double> density;
  for (const Vec3& p : sphere.vertices) density.push_back(1 + 3 * p.z * p.z);
  for (const bool weighted : {false, true}) {
    Settled settled(sphere, weighted ? density : std::vector<double>{});
    CvtRun& run = settled.run();
    const SeedsBefore before = seeds_before(run);
    disturb(run.seeds);
    const PlacedSeeds disturbed = run.seeds;
    const std::vector<Vec3> start = complete(run, true).vectors;
    const double disturbed_energy = run.energy;
    optimise_around(run, before, settled.options);

    std::vector<Index> moved;
    for (Index i = 0; i < kSeeds; ++i)
      if (run.seeds.position(i) != disturbed.position(i)) moved.push_back(i);
    EXPECT_GT(moved.size(), 30u);
    EXPECT_LT(moved.size(), 200u);
    // The piece is exact: what vanishes there vanishes on the whole surface.
    const std::vector<Vec3> end = complete(run, true).vectors;
    EXPECT_LT(largest(end, moved), 0.02 * largest(start, moved));
    EXPECT_LT(run.energy, disturbed_energy);
  }
}

TEST(OptimiseAround, DoesNothingWhereNothingChanged) {
  Settled settled(icosphere(4));
  const std::vector<Vec3> positions = settled.free.seeds();
  optimise_around(settled.run(), seeds_before(settled.run()), settled.options);
  EXPECT_EQ(settled.free.seeds(), positions);
}

TEST(OptimiseAround, OptimisesAllWhereAllChanged) {
  Settled settled(icosphere(4));
  CvtRun& run = settled.run();
  const SeedsBefore before = seeds_before(run);
  for (Vec3& x : run.seeds.edit_positions()) x = 1.01 * x;
  const PlacedSeeds start = run.seeds;
  settled.options.iterations = 5;
  optimise_around(run, before, settled.options);
  const std::vector<Vec3> around = settled.free.seeds();
  run.seeds = start;
  optimise(run, settled.options);
  EXPECT_EQ(settled.free.seeds(), around);
}

// The result is the same whatever the number of threads.
TEST(OptimiseAround, RepeatsBitForBit) {
  Settled settled(torus(96, 64));
  CvtRun& run = settled.run();
  const PlacedSeeds start = run.seeds;
  std::vector<Vec3> first;
  for (const unsigned threads : {1u, 2u}) {
    const ThreadLimit limit(threads);
    run.seeds = start;
    const SeedsBefore before = seeds_before(run);
    disturb(run.seeds);
    optimise_around(run, before, settled.options);
    if (first.empty()) first = settled.free.seeds();
    EXPECT_EQ(settled.free.seeds(), first);
  }
}

// Where a surface of a quarter of the triangles stands in, whose vertices are on the finer one and whose faces are not.
TEST(OptimiseAround, EndsOnTheSurfaceThatAnotherStandsInFor) {
  const Surface coarse(icosphere(4));
  CpuBackend stand_in(coarse, NeighbourSource::nearest);
  Settled settled(icosphere(5));
  CvtRun& run = settled.run();
  const PlacedSeeds start = run.seeds;
  for (const int steps : {4, 60}) {  // the first are too few for any to be made on the surface itself
    SCOPED_TRACE(steps);
    settled.options.iterations = steps;
    run.seeds = start;
    const SeedsBefore before = seeds_before(run);
    disturb(run.seeds);
    const PlacedSeeds disturbed = run.seeds;
    complete(run, true);
    const double disturbed_energy = run.energy;
    optimise_around(run, before, settled.options, &stand_in);
    std::size_t moved = 0;
    for (Index i = 0; i < kSeeds; ++i) {
      if (run.seeds.position(i) == disturbed.position(i)) continue;
      ++moved;
      EXPECT_LE(norm(nearest_of_all(settled.surface, run.seeds.position(i)) - run.seeds.position(i)), 1e-12);
    }
    EXPECT_GT(moved, 30u);
    EXPECT_LT(moved, 200u);
    complete(run, true);
    EXPECT_LT(run.energy, disturbed_energy);
  }
}

TEST(OptimiseWithStandIn, MakesItsLastStepsOnTheSurface) {
  const Surface fine(icosphere(5)), coarse(icosphere(4));
  CpuBackend backend(fine, NeighbourSource::nearest), stand_in(coarse, NeighbourSource::nearest);
  OptimiseOptions options;
  options.iterations = 40;
  options.constrained = true;
  FreeRun alone(backend, initial_seeds(fine, kSeeds, 7)), together(backend, alone.seeds());
  optimise(alone.run, options);
  optimise_with_stand_in(together.run, &stand_in, options);
  EXPECT_EQ(&together.run.backend(), &backend);
  for (const Vec3& x : together.seeds()) EXPECT_LE(norm(nearest_of_all(fine, x) - x), 1e-12);
  EXPECT_NEAR(together.run.energy, alone.run.energy, 0.01 * alone.run.energy);
  // Without a share of the steps for the surface, seeds stay where the other one has them.
  FreeRun apart(backend, initial_seeds(fine, kSeeds, 7)), on_it(stand_in, apart.seeds());
  optimise_with_stand_in(apart.run, &stand_in, options, 0);
  optimise(on_it.run, options);
  EXPECT_EQ(apart.seeds(), on_it.seeds());
}

}  // namespace
}  // namespace bisector::test
