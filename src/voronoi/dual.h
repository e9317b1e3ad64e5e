// The restricted Delaunay triangulation, read off the labels of the restricted Voronoi diagram (thesis 4.4.4).
#pragma once

#include <vector>

#include "core/geometry.h"
#include "voronoi/diagram.h"

namespace bisector {

Dual extract_dual(const RestrictedPolygons& polygons);

// The dual of a surface from those of its parts, each a set of its triangles, which are numbered as in the whole.
Dual merge_duals(const std::vector<Dual>& parts);

// The number of each seed among those that have a triangle, in the order of the seeds; kNone for the others.
std::vector<Index> dual_vertices(const Dual& dual, std::size_t seeds);

// A pair of cells that share an edge of positive length of the diagram.
struct DualEdge {
  Index a, b;     // a < b
  Vec3 crossing;  // the point of the restricted Voronoi edge nearest to the middle of the two seeds
};

// All such pairs, sorted.
std::vector<DualEdge> extract_dual_edges(const RestrictedPolygons& polygons, const std::vector<Vec3>& seeds);

// Marks the neighbours of marked seeds as well.
void mark_neighbours(const std::vector<DualEdge>& edges, std::vector<char>& marked);

}  // namespace bisector
