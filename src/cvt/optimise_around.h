// Optimising where seeds have changed, at a cost that follows the change and not the surface.
#pragma once

#include <functional>
#include <vector>

#include "cvt/optimise.h"
#include "voronoi/dual.h"

namespace bisector {

// What a run's seeds were before some were added, removed or moved.
struct SeedsBefore {
  std::vector<Vec3> positions;
  std::vector<DualEdge> edges;
};

// The run's seeds as they are.
SeedsBefore seeds_before(CvtRun& run);

// Moves seeds of a run, in which those that are not to move are fixed. `seeds`: which of the whole run's they are.
using MoveSeeds = std::function<void(CvtRun& run, const std::vector<Index>& seeds)>;

// Moves the seeds a few rings around those that changed since, with the others where they are: on the piece of the
// surface that their cells and those around them cover, which the CPU's backend evaluates. Where much has changed, or
// triangles are so large that the piece is no smaller than the surface, all seeds of the whole run may move.
void move_around(CvtRun& run, const SeedsBefore& before, const MoveSeeds& move);
// By the optimiser; where there is a surface that stands in for the run's, most of the steps on that.
void optimise_around(CvtRun& run, const SeedsBefore& before, const OptimiseOptions& options,
                     Backend* stand_in = nullptr);

}  // namespace bisector
