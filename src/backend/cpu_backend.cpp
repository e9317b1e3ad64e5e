#include "backend/cpu_backend.h"

#include <utility>

#include "core/processor.h"

namespace bisector {

CpuBackend::CpuBackend(const Surface& surface, NeighbourSource source) : CpuBackend(surface, source, {}) {}

CpuBackend::CpuBackend(const Surface& surface, NeighbourSource source, std::string fallback)
    : surface_(surface), source_(source), fallback_(std::move(fallback)), diagram_(surface) {}

BackendDescription CpuBackend::description() const { return {processor_name(), "cpu", "double", fallback_}; }

void CpuBackend::evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) {
  diagram_.evaluate(seeds, source_, moments);
}

void CpuBackend::evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) {
  diagram_.evaluate(seeds, source_, moments, polygons);
}

}  // namespace bisector
