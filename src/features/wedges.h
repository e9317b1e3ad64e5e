// Edges laid across narrow wedges between two feature curves, so that details can be simplified along them.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/features.h"
#include "features/edge_splits.h"

namespace bisector {

// A vertex on an edge from a to b, at a + t (b - a).
struct EdgePoint {
  Index a, b;
  double t;
};

// Curves can only be parted where edges of the mesh lead from one to the other (features/simplify.h). A straight edge
// of a part may have no vertex as far as that, so two curves that leave a corner, or corners near each other, at less
// than about 12 degrees get vertices and edges from one to the other where they are a sixteenth of an edge length
// apart, an eighth, and so on up to one, as far as they open by less than 30 degrees; the surface stays as it is.
// `edge_length` has one value per vertex, in the mesh's unit. Labels and face_of_triangle follow. Returns the vertices
// that were added, in order, of edges as they were when each was.
std::vector<EdgePoint> link_wedges(TriangleMesh& mesh, const FeatureGraph& features,
                                   const std::vector<double>& edge_length);

// The first of these vertices has the index `first`.
EdgeSplits splits_of(const std::vector<EdgePoint>& points, std::size_t first);

}  // namespace bisector
