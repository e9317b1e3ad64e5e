// A polygon in which a cell meets a surface, as other parts of the diagram are made of it.
#pragma once

#include <span>

#include "core/geometry.h"
#include "voronoi/moments.h"

namespace bisector {

struct CellPolygon {
  Index facet;
  std::span<const Index> labels;  // lines in cyclic order, the least first: slots or edges; none for all of the facet
  Moments moments;                // about the seed
};

}  // namespace bisector
