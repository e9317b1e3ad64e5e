// Diagrams of a surface that is divided among the ranks of a run.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "backend/backend.h"
#include "distributed/part_diagram.h"
#include "distributed/ranks.h"

namespace bisector {

// On rank 0: gives the bits of CpuBackend while all ranks compute. The others have to be in serve(). Throws RankFailed
// where another rank has failed; the backend goes on to work if the rank does.
class DistributedBackend : public Backend {
 public:
  // Facets are divided among the ranks so that each has about the same number of them and the same mass. The ranks must
  // outlive the backend.
  DistributedBackend(const Surface& surface, NeighbourSource source, Ranks& ranks);
  ~DistributedBackend() override;

  BackendDescription description() const override;
  double mass_tolerance() const override { return 1e-12; }
  // Of the last diagram, by rank.
  std::vector<PartFigures> figures();

 protected:
  EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override;

 private:
  Ranks& ranks_;
  NeighbourSource source_;
  std::uint64_t domain_;
  std::unique_ptr<PartDiagram> part_;
};

// On every other rank: takes part in all that rank 0 computes, until it calls end_serving().
void serve(Ranks& ranks);
// On rank 0, when there are no backends any more.
void end_serving(Ranks& ranks) noexcept;

}  // namespace bisector
