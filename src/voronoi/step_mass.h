// The mass that scales a seed's step: its cell's, or a quarter of the median mass of the six nearest seeds where that
// is more, so that a vanishing cell does not take an enormous step.
#pragma once

#include <functional>

#include "voronoi/neighbours.h"
#include "voronoi/restricted.h"

namespace bisector {

// Sets result.step_mass from result.cells.
void set_step_masses(const SortedSeeds& seeds, const Neighbours& neighbours, CellMoments& result);
// The same for those of result.step_mass that are negative; the others are known already.
void complete_step_masses(const SortedSeeds& seeds, const std::function<const Neighbours&()>& neighbours,
                          CellMoments& result);

}  // namespace bisector
