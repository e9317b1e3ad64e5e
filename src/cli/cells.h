// Restricted Voronoi cells as coloured polygons.
#pragma once

#include <cstddef>

#include "bisector/mesh/io.h"
#include "bisector/voronoi/restricted.h"

namespace bisector::cli {

// One polygon per pair of cell and triangle, labelled by its seed. Cells that share an edge of the diagram differ in
// colour, up to eleven neighbours of lower index.
PolygonMesh coloured_cells(const RestrictedPolygons& polygons, std::size_t seeds);

}  // namespace bisector::cli
