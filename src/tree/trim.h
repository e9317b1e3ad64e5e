// Branches end where their points no longer carry a radius.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"
#include "tree/limb.h"

namespace bisector {

// One past the last point of the axis that a chain of places leads to whose radii rest on points, with gaps of a few
// diameters at most, from the base on, which may be `hidden` in the parent for a length; 0 if there are too few.
std::size_t fitted_end(const Limb& limb, double hidden);

// Keeps of each limb what leads to its fitted end. Limbs without such a place near their base go, and
// those whose parent went or ends before they begin. Parents come first before and after.
void trim_limbs(std::vector<Limb>& limbs);

// Of each point the limb on whose surface it lies, or inside, up to a distance out of it; kNone for others. Of several
// the nearest.
std::vector<Index> limbs_of_points(const std::vector<Vec3>& points, const std::vector<Limb>& limbs, double distance);

}  // namespace bisector
