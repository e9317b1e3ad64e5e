// Polygons for callers that have the regions' borders already.
#pragma once

#include "bisector/polygonise.h"
#include "bisector/region_borders.h"

namespace bisector {

// The same as the public function; the borders are region_borders(mesh, segmentation).
PolygonisedMesh polygonise(const TriangleMesh& mesh, const SegmentResult& segmentation, const RegionBorders& borders,
                           const PolygoniseOptions& options);

}  // namespace bisector
