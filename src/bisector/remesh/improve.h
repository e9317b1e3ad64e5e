// The last pass of remeshing: bad triangles and irregular vertices are mended one by one, where CVT has settled in a local
// minimum. Seeds are moved, removed and inserted; the mesh stays the restricted Delaunay triangulation of the seeds.
//
// Each change is tried on a small patch of the dual (improve_patch.h). The best ones of patches that do not overlap are made
// together and one diagram of all seeds says which of them hold: a change stays if its triangles cost less in the dual itself,
// none of them is worse than the worst before unless it meets the goal, and topology and feature curves are as before.
#pragma once

#include "bisector/cvt/optimise.h"
#include "bisector/mesh/topology.h"
#include "bisector/remesh/feature_trace.h"

namespace bisector {

struct ImproveOptions {
  double min_angle = 40, max_angle = 95;  // degrees; the goal. It is not reached everywhere
  std::size_t vertices = 0;               // wanted
};

struct ImproveReport {
  std::size_t trials = 0;    // changes looked at
  std::size_t made = 0;      // that stayed
  std::size_t inserted = 0, removed = 0;  // seeds, by those
  std::size_t missed = 0;    // triangles of the result beyond the goal
};

// `polygons` must be those of state.seeds, whose cells must not be empty, and `trace` of options.curves; both are that again in
// the end, and the state is complete. Seeds must be on the surface. The count of seeds moves towards the one wanted.
ImproveReport improve(Backend& backend, CvtState& state, RestrictedPolygons& polygons, const FeatureTrace& trace,
                      const ImproveOptions& options, OptimiseOptions step, OptimiseTotals& totals, const Context& context);

}  // namespace bisector
