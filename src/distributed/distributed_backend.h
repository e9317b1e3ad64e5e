// Diagrams of a surface that is divided among the ranks of a run.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "distributed/part_diagram.h"
#include "distributed/parts.h"
#include "distributed/ranks.h"

namespace bisector {

// What rank 0 knows of a surface that all have read in parts.
struct FileOfRanks : DividedSurface {
  std::uint64_t domain = 0;
};
// On rank 0: lets all ranks read the file, as read_divided() does. Throws RankFailed, too.
FileOfRanks read_on_all(const std::string& path, std::size_t wanted, Ranks& ranks);

// On rank 0: gives the bits of CpuBackend while all ranks compute. The others have to be in serve(). Throws RankFailed
// where another rank has failed; the backend goes on to work if the rank does.
class DistributedBackend : public Backend {
 public:
  // Facets are divided among the ranks so that each has about the same number of them and the same mass. The ranks must
  // outlive the backend.
  DistributedBackend(const Surface& surface, NeighbourSource source, Ranks& ranks);
  // Of a surface that the ranks have read in parts. There is no surface(). The part is taken.
  DistributedBackend(FileOfRanks& file, NeighbourSource source, Ranks& ranks);
  ~DistributedBackend() override;

  BackendDescription description() const override;
  double mass_tolerance() const override { return 1e-12; }
  // Where the surface is in parts, the ranks have the triangles of cells.
  Want projected() const override { return stays_ ? Want::moments : Want::triangles; }
  void project(const CellMoments& cells, std::span<const SeedPlace> places, std::span<Vec3> seeds,
               std::vector<Vec3>& normals) override;
  // Of the last diagram, by rank.
  std::vector<PartFigures> figures();

 protected:
  EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override;

 private:
  Ranks& ranks_;
  NeighbourSource source_;
  std::uint64_t domain_;
  bool stays_ = false;  // the surface stays where it was read
  double area_;
  std::unique_ptr<PartDiagram> part_;
  std::uint64_t diagrams_ = 0;
};

// On every other rank: takes part in all that rank 0 computes, until it calls end_serving().
void serve(Ranks& ranks);
// On rank 0, when there are no backends any more.
void end_serving(Ranks& ranks) noexcept;

}  // namespace bisector
