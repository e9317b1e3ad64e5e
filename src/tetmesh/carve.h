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
// triangle twice. Throws Error if one triangle puts a tetrahedron inside and another one outside, or if the inside
// reaches the tetrahedra's own border elsewhere than at the boundary.
Carved carve(const std::vector<Tetrahedron>& tets, const std::vector<Triangle>& boundary);

}  // namespace bisector
