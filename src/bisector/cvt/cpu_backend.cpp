#include "bisector/cvt/cpu_backend.h"

namespace bisector {

CpuBackend::CpuBackend(const Surface& surface, NeighbourSource source)
    : surface_(surface), source_(source), diagram_(surface) {}

void CpuBackend::evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) {
  diagram_.evaluate(seeds, source_, moments);
}

void CpuBackend::evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) {
  diagram_.evaluate(seeds, source_, moments, polygons);
}

}  // namespace bisector
