// Colours for patches of a surface, and restricted Voronoi cells as coloured polygons.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/io.h"
#include "voronoi/restricted.h"

namespace bisector::job {

// A colour for each of `count` patches, given those that meet: pairs, the higher first, ascending. Neighbours differ,
// up to eleven neighbours of lower index.
std::vector<std::array<unsigned char, 3>> contrasting_colours(const std::vector<std::array<Index, 2>>& neighbours,
                                                              std::size_t count);

// Polyhedra with their vertices and faces, each of its own; those of one cell and one tetrahedron.
PolyhedronMesh polyhedra_of(const ClippedPolyhedra& polyhedra);

// One polygon per pair of cell and triangle, labelled by its seed, in contrasting colours.
PolygonMesh coloured_cells(const RestrictedPolygons& polygons, std::size_t seeds);

}  // namespace bisector::job
