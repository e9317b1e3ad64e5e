// Branches from a rough skeleton: axes and radii by least squares, twigs that are only parts of their parent's surface
// merged into it, and roots on the parent's axis.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "tree/limb.h"

namespace bisector {

struct RefineOptions {
  double noise = 0;  // standard deviation of points off the surface, in the points' unit
  int passes = 3;    // of fitting, giving points to parents, and merging
};

// `limbs` come parents first, with axes and points; radii are not used. `neighbours` is the graph of the points.
// Branches that do not stand out of their parent, or lie in the surface of another, are merged into it; their children
// become its children. Points that hang together and are left off the surface of their branch become branches of their
// own.
std::vector<Limb> refine_limbs(const std::vector<Vec3>& points, const Csr<Index>& neighbours, std::vector<Limb> limbs,
                               const RefineOptions& options, const Context& context = {});

}  // namespace bisector
