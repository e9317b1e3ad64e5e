#include "backend/cpu_backend.h"

#include <utility>

#include "core/processor.h"

namespace bisector {

template <class Base, class Voronoi>
template <class Domain, class... Options>
CpuBackendOf<Base, Voronoi>::CpuBackendOf(const Domain& domain, NeighbourSource source, std::string fallback,
                                          Options... options)
    : Base(domain), source_(source), fallback_(std::move(fallback)), diagram_(domain, options...) {}

template <class Base, class Voronoi>
BackendDescription CpuBackendOf<Base, Voronoi>::description() const {
  return {processor_name(), "cpu", "double", fallback_};
}

template <class Base, class Voronoi>
void CpuBackendOf<Base, Voronoi>::compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) {
  diagram_.evaluate(seeds, source_, want, diagram);
}

template class CpuBackendOf<Backend, RestrictedVoronoi>;
template class CpuBackendOf<SolidBackend, ClippedVoronoi>;

CpuBackend::CpuBackend(const Surface& surface, NeighbourSource source, std::string fallback)
    : CpuBackendOf(surface, source, std::move(fallback)) {}

CpuSolidBackend::CpuSolidBackend(const Solid& solid, NeighbourSource source, InnerCells inner, std::string fallback)
    : CpuBackendOf(solid, source, std::move(fallback), inner) {}

}  // namespace bisector
