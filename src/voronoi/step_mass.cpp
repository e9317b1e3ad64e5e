#include "voronoi/step_mass.h"

#include <algorithm>

#include "core/parallel.h"

namespace bisector {
namespace {

double largest_mass(const CellMoments& result) {
  double largest = 0;
  for (const Moments& cell : result.cells) largest = std::max(largest, cell.mass);
  return largest;
}

}  // namespace

double step_mass(double own, double* nearest, std::size_t count) {
  if (count == 0) return std::max(own, 0.0);
  std::nth_element(nearest, nearest + count / 2, nearest + count);
  return std::max(own, kStepShare * nearest[count / 2]);
}

void set_step_masses(const SortedSeeds& seeds, const Neighbours& neighbours, CellMoments& result) {
  result.step_mass.assign(result.cells.size(), -1);
  complete_step_masses(
      seeds, [&]() -> const Neighbours& { return neighbours; }, result);
}

void complete_step_masses(const SortedSeeds& seeds, const std::function<const Neighbours&()>& neighbours,
                          CellMoments& result) {
  const double largest = largest_mass(result);
  const auto needs_median = [&](std::size_t i) {
    return result.step_mass[i] < 0 && result.cells[i].mass < kStepShare * largest;
  };
  const Neighbours* list = nullptr;
  for (std::size_t s = 0; !list && s < seeds.x.size(); ++s)
    if (needs_median(seeds.id[s])) list = &neighbours();
  parallel_each(seeds.x.size(), [&](std::size_t s) {
    const Index i = seeds.id[s];
    if (!needs_median(i)) return;
    Index near[kStepNeighbours];
    double masses[kStepNeighbours];
    const std::size_t count = list->nearest_to(static_cast<Index>(s), kStepNeighbours, near);
    for (std::size_t k = 0; k < count; ++k) masses[k] = result.cells[seeds.id[near[k]]].mass;
    result.step_mass[i] = step_mass(result.cells[i].mass, masses, count);
  });
  parallel_each(result.step_mass.size(), [&](std::size_t i) {
    if (result.step_mass[i] < 0) result.step_mass[i] = result.cells[i].mass;
  });
}

}  // namespace bisector
