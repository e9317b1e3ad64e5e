#include "voronoi/step_mass.h"

#include <algorithm>

#include "core/parallel.h"

namespace bisector {
namespace {

constexpr std::size_t kNear = 6;
constexpr double kShare = 0.25;

double largest_mass(const CellMoments& result) {
  double largest = 0;
  for (const Moments& cell : result.cells) largest = std::max(largest, cell.mass);
  return largest;
}

double median_nearby(const SortedSeeds& seeds, const Neighbours& neighbours, Index slot, const CellMoments& result) {
  Index near[kNear];
  const std::size_t count = neighbours.nearest_to(slot, kNear, near);
  if (count == 0) return 0;
  double masses[kNear] = {};
  std::transform(near, near + count, masses, [&](Index j) { return result.cells[seeds.id[j]].mass; });
  std::nth_element(masses, masses + count / 2, masses + count);
  return masses[count / 2];
}

}  // namespace

void set_step_masses(const SortedSeeds& seeds, const Neighbours& neighbours, CellMoments& result) {
  result.step_mass.assign(result.cells.size(), -1);
  complete_step_masses(
      seeds, [&]() -> const Neighbours& { return neighbours; }, result);
}

void complete_step_masses(const SortedSeeds& seeds, const std::function<const Neighbours&()>& neighbours,
                          CellMoments& result) {
  const double largest = largest_mass(result);
  // A median is at most the largest mass, so a cell of a quarter of that needs none.
  const auto needs_median = [&](std::size_t i) {
    return result.step_mass[i] < 0 && result.cells[i].mass < kShare * largest;
  };
  const Neighbours* near = nullptr;
  for (std::size_t s = 0; !near && s < seeds.x.size(); ++s)
    if (needs_median(seeds.id[s])) near = &neighbours();
  parallel_each(seeds.x.size(), [&](std::size_t s) {
    const Index i = seeds.id[s];
    if (needs_median(i))
      result.step_mass[i] =
          std::max(result.cells[i].mass, kShare * median_nearby(seeds, *near, static_cast<Index>(s), result));
  });
  parallel_each(result.step_mass.size(), [&](std::size_t i) {
    if (result.step_mass[i] < 0) result.step_mass[i] = result.cells[i].mass;
  });
}

}  // namespace bisector
