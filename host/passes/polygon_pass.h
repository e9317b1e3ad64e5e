// Polygons of a diagram that the device has found: labels from the device, coordinates by the CPU's formula from these,
// so that they are the CPU's bit for bit in either precision.
#pragma once

#include "host/passes/facet_pairs.h"
#include "voronoi/restricted.h"

namespace bisector::host {

class PolygonPass {
 public:
  explicit PolygonPass(Device& device) : labels_(device) {}

  // The polygons of all pairs in the store, in order of triangles, then cells.
  void run(PairPass& pairs, const PairJob& job, FacetPairs& domain, bool with_vertices, RestrictedPolygons& polygons);

 private:
  Buffer labels_;
};

}  // namespace bisector::host
