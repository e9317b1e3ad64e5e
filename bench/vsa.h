// The yardstick for planar regions: CGAL's Surface_mesh_approximation.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector::bench {

// CGAL's partition of an edge-manifold mesh into planar proxies (Cohen-Steiner et al. 2004), from hierarchical seeding
// and so many iterations; the L2,1 metric or the L2 one. The region of each triangle.
std::vector<Index> cgal_regions(const TriangleMesh& mesh, std::size_t proxies, std::size_t iterations, bool l21);

}  // namespace bisector::bench
