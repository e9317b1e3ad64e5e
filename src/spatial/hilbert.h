// Spatial order of points along the Hilbert curve of their bounding box.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

// Indices of `points` in Hilbert order (21 bits per axis); equal points follow each other in ascending index.
std::vector<Index> hilbert_order(const std::vector<Vec3>& points);

}  // namespace bisector
