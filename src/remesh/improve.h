// The last pass of remeshing: bad triangles and irregular vertices are mended one by one, where CVT has settled in a
// local minimum. Seeds are moved, removed and inserted; the mesh stays the restricted Delaunay triangulation of the
// seeds.
//
// Each change is tried on a small patch of the dual (improve_patch.h). The best ones of patches that do not overlap are
// made together and one diagram of all seeds says which of them hold: a change stays if its triangles cost less in the
// dual itself, none of them is worse than the worst before unless it meets the goal, and topology and feature curves
// are as before. Angles below 30 degrees that are left then, and that no two curves impose, are searched for: changes
// of several steps, which may make other angles smaller as long as they are not bad.
#pragma once

#include "bisector/remesh.h"
#include "cvt/optimise.h"
#include "remesh/feature_trace.h"

namespace bisector {

struct ImproveOptions {
  // Degrees. The goal, which is not reached everywhere. The largest angle leaves room for right-angled corners of
  // features.
  double min_angle = 40, max_angle = 91;
  std::size_t vertices = 0;  // wanted; 0: as many as there are
};

// The seeds must lie on the surface, and `trace` must be that of run.curves(); afterwards run.energy and
// run.gradient_norm are those of the new seeds, held on the surface. Corners and other fixed seeds do not move, nor do
// seeds at a border that is no feature. No angle beyond the goal gets worse than the worst before, and neither does the
// mean cost of a triangle (shape_cost in improve_patch.h). The count moves to the one wanted where that costs little.
// Throws Cancelled.
ImproveReport improve(CvtRun& run, const FeatureTrace& trace, const ImproveOptions& options);

}  // namespace bisector
