// Random points in solids.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry.h"

namespace bisector {

// `count` points, distributed as the density, one value per vertex and linear on each tetrahedron (empty: uniform),
// stratified: along a spatial order of the tetrahedra each has its share to within two. The same for any number of
// threads. Throws Error if there is no volume.
std::vector<Vec3> sample_solid(const TetMesh& mesh, std::size_t count, std::uint64_t random_seed,
                               const std::vector<double>& density = {});

}  // namespace bisector
