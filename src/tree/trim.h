// Branches end where their points no longer carry a radius.
#pragma once

#include <vector>

#include "core/geometry.h"
#include "tree/limb.h"

namespace bisector {

// Keeps of each limb what leads from its base to the last place where its radius rests on points; gaps of a few
// diameters between such places stay, for branches hide each other. Limbs without such a place near their base go, and
// those whose parent went or ends before they begin. Parents come first before and after.
void trim_limbs(std::vector<Limb>& limbs);

// Of each point the limb on whose surface it lies, or inside, up to a distance out of it; kNone for others. Of several
// the nearest.
std::vector<Index> limbs_of_points(const std::vector<Vec3>& points, const std::vector<Limb>& limbs, double distance);

}  // namespace bisector
