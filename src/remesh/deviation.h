// Where a result is farther from its input than it may be, and how long edges should be there.
#pragma once

#include <cstddef>

#include "bisector/context.h"
#include "core/geometry.h"
#include "remesh/size_bounds.h"

namespace bisector {

struct Deviation {
  double upper = 0;   // bound of the Hausdorff distance, in the mesh's unit; at most that asked for if it is kept
  SizeBounds bounds;  // of edges, where distances are known
  double growth = 1;  // by how much the number of vertices grows with such edges
};

// The distance of a chord from a curve is as the square of its length, so that each triangle says how long edges may be
// there for a distance of `aim`, a share of `most`: distances of alike triangles vary, and another run has others. Both
// are positive. Throws Error if either mesh has no area; Cancelled.
Deviation find_deviation(const TriangleMesh& result, const TriangleMesh& input, double most, double aim,
                         const Context& context);

}  // namespace bisector
