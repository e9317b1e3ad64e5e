// Random points on a surface.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct SurfaceSample {
  Vec3 point;
  Index triangle;
};

// `count` independent points with probability proportional to area times a density that is linear on each triangle
// (Turk 1990; thesis 4.4.1). `density` holds one positive value per vertex, or is empty for uniform. The same
// random_seed gives the same points on every platform, and the first ones of a larger count are those of a smaller.
// Throws Error if the mesh has no area or a density is negative, not finite or missing.
std::vector<SurfaceSample> sample_surface(const TriangleMesh& mesh, std::size_t count, std::uint64_t random_seed,
                                          const std::vector<double>& density = {});

}  // namespace bisector
