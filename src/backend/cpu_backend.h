// The backend that defines the answer: all cores, double precision, exact signs.
#pragma once

#include <string>

#include "backend/backend.h"

namespace bisector {

class CpuBackend : public Backend {
 public:
  // The surface must outlive the backend.
  CpuBackend(const Surface& surface, NeighbourSource source);
  // In place of a device that was given up, for this reason.
  CpuBackend(const Surface& surface, NeighbourSource source, std::string fallback);

  const Surface& surface() const override { return surface_; }
  BackendDescription description() const override;
  double mass_tolerance() const override { return 1e-12; }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) override;
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) override;

 private:
  const Surface& surface_;
  NeighbourSource source_;
  std::string fallback_;
  RestrictedVoronoi diagram_;
};

}  // namespace bisector
