// Polygons of a diagram: how they leave a clipper, and where those of a triangle lie.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "voronoi/clip.h"
#include "voronoi/diagram.h"

namespace bisector {

// Appends the clipper's polygon, which lies on the triangle, starting at the edge of the smallest label; slots become
// the caller's indices.
void append_polygon(const Clipper& clipper, const SortedSeeds& seeds, Index triangle, Index slot,
                    RestrictedPolygons& out);

// The same without vertices, from the labels of a polygon on the facet in cyclic order.
void append_labels(const Facet& facet, const SortedSeeds& seeds, Index triangle, Index slot,
                   std::span<const Index> labels, RestrictedPolygons& out);

// The first polygon of each triangle, and one past the last.
std::vector<std::size_t> first_polygons(const RestrictedPolygons& polygons, std::size_t triangles);

// Appends the polygons from `begin` to before `end`.
void append_polygons(const RestrictedPolygons& from, std::size_t begin, std::size_t end, RestrictedPolygons& out);

double polygon_area(const RestrictedPolygons& polygons, std::size_t polygon);

// The nearest point of a convex polygon.
Vec3 nearest_on_polygon(const RestrictedPolygons& polygons, std::size_t polygon, const Vec3& p);

}  // namespace bisector
