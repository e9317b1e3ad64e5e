// The mass that scales a seed's step: its cell's, or a quarter of the median mass of the six nearest seeds where that
// is more, so that a vanishing cell does not take an enormous step.
#pragma once

#include <functional>

#include "voronoi/neighbours.h"
#include "voronoi/restricted.h"

namespace bisector {

// Only cells of less than this share of the largest mass need the median of so many nearest seeds: it is at most that
// mass.
inline constexpr double kStepShare = 0.25;
inline constexpr std::size_t kStepNeighbours = 6;
// The step mass of a cell from its own and those of its nearest seeds, which are put into another order.
double step_mass(double own, double* nearest, std::size_t count);

// Sets result.step_mass from result.cells.
void set_step_masses(const SortedSeeds& seeds, const Neighbours& neighbours, CellMoments& result);
// The same for those of result.step_mass that are negative; the others are known already.
void complete_step_masses(const SortedSeeds& seeds, const std::function<const Neighbours&()>& neighbours,
                          CellMoments& result);

}  // namespace bisector
