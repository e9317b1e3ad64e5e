// Two-sided distance between surfaces by dense sampling against an AABB tree.
#pragma once

#include <cstdint>

#include "core/geometry.h"

namespace bisector {

struct DistanceReport {
  // In percent of the diagonal of the reference's bounding box. `mean` and `rms` are over area and the larger of the
  // two one-sided values; `max`, over the samples and vertices of both sides, is the Hausdorff distance from below.
  double mean = 0, rms = 0, max = 0;
  double rms_to_reference = 0, rms_from_reference = 0;
  std::size_t samples = 0;   // on each side
};

// Area-uniform stratified samples plus the vertices of each side; reproducible from `random_seed`, for any thread
// count. Throws Error if a mesh has no area.
DistanceReport measure_distance(const TriangleMesh& mesh, const TriangleMesh& reference, std::size_t samples = 200'000,
                                std::uint64_t random_seed = 1);

}  // namespace bisector
