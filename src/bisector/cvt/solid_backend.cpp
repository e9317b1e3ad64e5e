#include "bisector/cvt/solid_backend.h"

#include <fmt/format.h>

#include <utility>

#include "bisector/core/error.h"
#include "bisector/core/processor.h"

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

std::unique_ptr<SolidBackend> make_backend(const Solid& solid, const ComputeOptions& options, const Context&) {
  if (options.device.starts_with("vulkan"))
    throw DeviceError(fmt::format("--device {}: clipped Voronoi diagrams of solids are computed on the CPU only; use --device cpu", options.device));
  if (options.device != "auto" && options.device != "cpu")
    throw Error(fmt::format("--device {}: is none of auto, cpu, vulkan, vulkan:INDEX, vulkan:UUID", options.device));
  if (options.precision == Precision::single)
    throw Error("--precision single: the CPU computes in double precision only; use --precision double or a device");
  return std::make_unique<CpuSolidBackend>(solid, options.neighbours);
}

}  // namespace bisector
