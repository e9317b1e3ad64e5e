#include "backend/solid_backend.h"

#include <utility>

#include "core/processor.h"

namespace bisector {

CpuSolidBackend::CpuSolidBackend(const Solid& solid, NeighbourSource source, InnerCells inner, std::string fallback)
    : solid_(solid), source_(source), fallback_(std::move(fallback)), diagram_(solid, inner) {}

BackendDescription CpuSolidBackend::description() const { return {processor_name(), "cpu", "double", fallback_}; }

void CpuSolidBackend::evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) {
  diagram_.evaluate(seeds, source_, moments);
}

void CpuSolidBackend::evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) {
  diagram_.evaluate(seeds, source_, moments, polygons);
}

void CpuSolidBackend::evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons,
                               ClippedPolyhedra& polyhedra) {
  diagram_.evaluate(seeds, source_, moments, polygons, polyhedra);
}

}  // namespace bisector
