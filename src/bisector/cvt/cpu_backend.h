// The backend that defines the answer: all cores, double precision, exact signs.
#pragma once

#include "bisector/cvt/backend.h"

namespace bisector {

class CpuBackend : public Backend {
 public:
  // The surface must outlive the backend.
  CpuBackend(const Surface& surface, NeighbourSource source);

  const Surface& surface() const override { return surface_; }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) override;
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) override;

 private:
  const Surface& surface_;
  NeighbourSource source_;
  RestrictedVoronoi diagram_;
};

}  // namespace bisector
