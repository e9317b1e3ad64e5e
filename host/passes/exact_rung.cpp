#include "host/passes/exact_rung.h"

#include "voronoi/owner.h"

namespace bisector::host {
namespace {

constexpr double kFirstRadius = 3;  // in typical spacings; the first growth multiplies it

}  // namespace

void ExactRung::begin(const SortedSeeds& seeds, const Neighbours* neighbours, double spacing) {
  seeds_ = &seeds;
  given_ = neighbours;
  spacing_ = spacing;
  built_ = false;
}

const Neighbours& ExactRung::neighbours() {
  if (given_) return *given_;
  if (!built_) {
    own_.build_on_demand(*seeds_, kFirstRadius * spacing_);
    built_ = true;
  }
  return own_;
}

std::vector<Index> ExactRung::owners(const std::vector<Vec3>& points) {
  const Neighbours& near = neighbours();
  std::vector<Index> slots(points.size());
  parallel_each(
      points.size(), [&](std::size_t k) { slots[k] = find_owner(*seeds_, near, points[k], near.nearest(points[k])); },
      64);
  return slots;
}

}  // namespace bisector::host
