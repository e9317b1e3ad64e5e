// The yardstick for planar regions: CGAL's Surface_mesh_approximation.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector::bench {

// CGAL's partition of an edge-manifold mesh into planar proxies (Cohen-Steiner et al. 2004), from hierarchical seeding
// and so many iterations; the L2,1 metric or the L2 one. The region of each triangle.
std::vector<Index> cgal_regions(const TriangleMesh& mesh, std::size_t proxies, std::size_t iterations, bool l21);

struct CgalPolygons {
  std::vector<Index> labels;  // region of each triangle of the input
  TriangleMesh mesh;          // of the anchors, triangulated
  std::size_t polygons = 0;   // border polygons of the regions, holes not counted
};

// CGAL's coarse mesh of such regions, by the L2 metric: with its default parameters, or, for a positive `chord`,
// divided where a border strays from a chord by more than this share of its length times the sine of the angle between
// the planes.
CgalPolygons cgal_polygons(const TriangleMesh& mesh, std::size_t proxies, std::size_t iterations, double chord);

}  // namespace bisector::bench
