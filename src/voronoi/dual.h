// The restricted Delaunay triangulation, read off the labels of the restricted Voronoi diagram (thesis 4.4.4).
#pragma once

#include <vector>

#include "core/geometry.h"
#include "voronoi/restricted.h"

namespace bisector {

struct Dual {
  // Triples of cells that share a vertex of the diagram, each oriented as the surface at its first such vertex. Sorted as
  // ascending triples, without repeats.
  std::vector<Triangle> triangles;
  // How many vertices of the diagram each triple has; 1 where the topological ball property holds.
  std::vector<Index> multiplicity;
  std::vector<Index> mesh_triangle;  // in which its first such vertex lies
};

Dual extract_dual(const RestrictedPolygons& polygons);

// The number of each seed among those that have a triangle, in the order of the seeds; kNone for the others.
std::vector<Index> dual_vertices(const Dual& dual, std::size_t seeds);

// A pair of cells that share an edge of positive length of the diagram.
struct DualEdge {
  Index a, b;     // a < b
  Vec3 crossing;  // the point of the restricted Voronoi edge nearest to the middle of the two seeds
};

// All such pairs, sorted.
std::vector<DualEdge> extract_dual_edges(const RestrictedPolygons& polygons, const std::vector<Vec3>& seeds);

}  // namespace bisector
