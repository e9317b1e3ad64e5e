// The tetrahedra inside a closed surface that is made of their facets.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

struct Carved {
  std::vector<Tetrahedron> tets;  // those inside, in their order
  std::vector<Index> missing;     // triangles of the boundary that are not facets; if there are any, `tets` is empty
};

// `tets`: positive, each facet with at most two. `boundary`: closed, counter-clockwise seen from outside the solid, no
// triangle twice. Throws Error if some tetrahedron is inside by one triangle and outside by another, or the inside
// reaches the tetrahedra's own border elsewhere.
Carved carve(const std::vector<Tetrahedron>& tets, const std::vector<Triangle>& boundary);

}  // namespace bisector
