// How far the feature edges of two meshes are from each other.
#pragma once

#include <array>
#include <vector>

#include "core/geometry.h"

namespace bisector {

using FeatureEdges = std::vector<std::array<Index, 2>>;

struct FeatureDistance {
  // In percent of the diagonal of the reference's bounding box, by samples along the edges.
  double vertices = 0;        // largest distance of a vertex of the mesh's feature edges from those of the reference
  double to_reference = 0;    // of a point of the mesh's feature edges
  double from_reference = 0;  // of a point of the reference's feature edges from those of the mesh
};

// All 0 if neither has any; infinite if one alone has none.
FeatureDistance measure_feature_distance(const std::vector<Vec3>& vertices, const FeatureEdges& edges,
                                         const std::vector<Vec3>& reference_vertices, const FeatureEdges& reference_edges);

}  // namespace bisector
