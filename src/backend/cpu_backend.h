// The backends that define the answer: all cores, double precision, exact signs.
#pragma once

#include <string>
#include <vector>

#include "backend/backend.h"
#include "voronoi/clipped.h"
#include "voronoi/restricted.h"

namespace bisector {

// What a surface's and a solid's have in common: Base is Backend or SolidBackend, Voronoi RestrictedVoronoi or
// ClippedVoronoi.
template <class Base, class Voronoi>
class CpuBackendOf : public Base {
 public:
  BackendDescription description() const override;
  double mass_tolerance() const override { return 1e-12; }

 protected:
  template <class Domain, class... Options>
  CpuBackendOf(const Domain& domain, NeighbourSource source, std::string fallback, Options... options);

  EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override;

 private:
  NeighbourSource source_;
  std::string fallback_;
  Voronoi diagram_;
};

class CpuBackend : public CpuBackendOf<Backend, RestrictedVoronoi> {
 public:
  // `fallback`: why a device was given up for this one; empty if none was.
  CpuBackend(const Surface& surface, NeighbourSource source, std::string fallback = {});
};

class CpuSolidBackend : public CpuBackendOf<SolidBackend, ClippedVoronoi> {
 public:
  CpuSolidBackend(const Solid& solid, NeighbourSource source, SolidCells how = SolidCells::whole,
                  std::string fallback = {});
};

}  // namespace bisector
