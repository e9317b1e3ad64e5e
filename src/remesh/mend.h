// Angles that are bad where moving seeds can do no more: between curves that run close together a triangle that is good
// often is none of the restricted Delaunay triangulation.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "bisector/remesh.h"
#include "remesh/feature_trace.h"
#include "remesh/improve.h"
#include "remesh/improve_patch.h"

namespace bisector {

// Of a remeshed surface, while it is mended.
struct MendMesh {
  TriangleMesh& mesh;
  std::vector<SeedPlace>& places;  // of the mesh's vertices
  std::vector<Index> owners;       // the cells of the map that they are in, or kNone
  std::vector<Index>& broken;      // curves that are no chains of edges; afterwards, those that still are
  std::vector<Index> number = {};  // afterwards, of each vertex, the one that it has become, or kNone; empty: the same
  // The pairs of triangles that may cross, if more of them do and are to be mended.
  std::optional<std::size_t> may_cross = {};
};

// Where more pairs of triangles cross than one for so many vertices, neither changes here and there nor shorter edges
// help.
inline constexpr std::size_t kVerticesPerCrossing = 20;

// Mends triangles with an angle below 30 degrees that no two feature edges impose, with the changes of improve.h, which
// are made in the mesh itself. A change stays if less is missing of the angles around it, and if it makes no triangles
// intersect and keeps the topology; vertices stay on the surface, and curves chains of edges. New vertices come last,
// and those that are removed leave no gap. Where more triangles cross than may, changes around them stay that make the
// pairs fewer and no angle worse, unless there is more than one for kVerticesPerCrossing vertices. Labels are those of
// the surface's triangles in the middle. There is a bound on the searches, which begin with the worst triangles. Throws
// Cancelled.
MendReport mend_angles(const CellMap& map, const FeatureCurves& curves, const FeatureTrace& trace,
                       const ImproveOptions& options, MendMesh& result, const Context& context);

}  // namespace bisector
