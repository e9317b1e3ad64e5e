// Fewer triangles for display, by clustering of vertices (Rossignac and Borrel 1993).
#pragma once

#include <cstddef>
#include <vector>

#include "view/scene.h"

namespace bisector::view {

// A surface of at most so many triangles: vertices in one cell of a grid become their mean. What is shown has the worst
// value of what it stands for, so that no bad place is hidden. Tetrahedra are left out.
Model simplified(const Model& model, const std::vector<Measure>& measures, std::size_t most_triangles);

// At most so many of a model's points, evenly from their order.
Model thinned(const Model& model, std::size_t most_points);

}  // namespace bisector::view
