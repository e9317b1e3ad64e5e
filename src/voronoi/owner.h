// The cell that owns a point.
#pragma once

#include "voronoi/neighbours.h"

namespace bisector {

// The slot whose (perturbed) cell holds q. Walks from the slot `guess` to ever better seeds; one is the owner when no
// seed within twice its distance is better. The answer does not depend on the guess.
Index find_owner(const SortedSeeds& seeds, const Neighbours& neighbours, const Vec3& q, Index guess);

}  // namespace bisector
