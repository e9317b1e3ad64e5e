// The contract between the optimiser and whatever computes restricted Voronoi diagrams.
#pragma once

#include <vector>

#include "bisector/core/types.h"
#include "bisector/voronoi/restricted.h"

namespace bisector {

// A backend holds one surface. Every backend returns the same pairs and labels for the same seeds; moments agree to
// rounding, and runs repeat bit for bit.
class Backend {
 public:
  virtual ~Backend() = default;

  virtual const Surface& surface() const = 0;
  // Moments of all cells of the seeds' diagram.
  virtual void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) = 0;
  // The same, and the polygons.
  virtual void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) = 0;
};

}  // namespace bisector
