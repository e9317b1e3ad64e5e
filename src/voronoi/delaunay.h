// Neighbours of seeds from their Delaunay triangulation.
#pragma once

#include <optional>
#include <vector>

#include "core/geometry.h"

namespace bisector {

// For each of the distinct seeds, in ascending order of index, every other seed whose closed Voronoi cell meets its
// own: the Delaunay 1-ring, enlarged across cospherical cells so that it holds the neighbours under any perturbation of
// ties. Empty if the seeds lie in a plane, or if a cospherical cluster is so large that its lists would be quadratic.
std::optional<Csr<Index>> delaunay_neighbours(const std::vector<Vec3>& seeds);

}  // namespace bisector
