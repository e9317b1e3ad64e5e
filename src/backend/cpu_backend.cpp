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
EvaluationReport CpuBackendOf<Base, Voronoi>::compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) {
  const DiagramWork work = diagram_.evaluate(seeds, source_, want, diagram);
  EvaluationReport report;
  report.certification.pairs = work.counts.pairs;
  report.certification.uncertain = report.certification.cpu = work.counts.uncertain;
  report.certification.wider = work.counts.wider;
  report.seconds = {work.delaunay, work.neighbours, work.owners, work.clip, {}};
  return report;
}

template class CpuBackendOf<Backend, RestrictedVoronoi>;
template class CpuBackendOf<SolidBackend, ClippedVoronoi>;

CpuBackend::CpuBackend(const Surface& surface, NeighbourSource source, std::string fallback)
    : CpuBackendOf(surface, source, std::move(fallback)) {}

CpuSolidBackend::CpuSolidBackend(const Solid& solid, NeighbourSource source, SolidCells how, std::string fallback)
    : CpuBackendOf(solid, source, std::move(fallback), how) {}

}  // namespace bisector
