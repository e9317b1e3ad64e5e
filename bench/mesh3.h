// The yardstick for tetrahedral meshes: CGAL's Mesh_3.
#pragma once

#include <string>

#include "bisector/features.h"
#include "core/geometry.h"

namespace bisector::bench {

// CGAL's mesh of the inside of a closed surface with edges of about `edge`, its feature edges protected, optimised
// globally by "odt" or "lloyd" and then perturbed and exuded, each with CGAL's default limits.
TetMesh mesh_3(const TriangleMesh& surface, const FeatureGraph& features, double edge, const std::string& optimiser);

}  // namespace bisector::bench
