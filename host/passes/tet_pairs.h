// Pairs of tetrahedra and cells: the clipped Voronoi diagram of a solid.
#pragma once

#include "host/passes/device_solid.h"
#include "host/passes/exact_rung.h"
#include "host/passes/owner_pass.h"
#include "host/passes/pair_pass.h"

namespace bisector::host {

class TetPairs : public PairDomain {
 public:
  // Where cells are whole, those that do not meet the boundary are pairs of the enclosure, and start from those that
  // are known to lie inside; else pairs start from the owners of the vertices.
  TetPairs(bool is_double, DeviceSolid& solid, const OwnerPass& corners, ExactRung& exact, double batch_pairs);

  // For so many cells that are cut up.
  void plan(std::size_t cells);
  // For whole cells: the slots to start from, and a mark for each slot that meets the boundary
  // (kernels/layout/pairs.h).
  void plan_whole(std::vector<Index> starts, std::vector<Index> marks);
  // Of each slot whether a cell that was clipped exactly has it for a neighbour.
  const std::vector<Index>& marks() const { return marks_; }
  DeviceSolid& solid() const { return solid_; }

  const char* elements() const override { return "tetrahedra"; }
  bool is_solid() const override { return true; }
  double mean_density() const override { return solid_.solid.mass / solid_.solid.volume; }
  bool double_next() const override { return solid_.has_doubles; }
  double expected_pairs() const override { return expected_pairs_; }
  std::size_t batches() const override { return batches_.size(); }
  std::size_t chunk_of(std::size_t) const override { return 0; }
  void start(const PairJob& job, const PairBuffers& buffers, std::size_t batch) override;
  // Labels: see kernels/clip_tet.comp.
  void clip(const PairJob& job, const PairBuffers& buffers, std::size_t chunk, const ClipKind& kind, ClipPush push,
            const Buffer& labels, const ClipDispatch& dispatch) override;
  std::vector<ExactPair> clip_exactly(const PairJob& job, const std::vector<PairName>& pairs) override;

  static constexpr std::uint32_t kMostPlanes = 40, kMostVertices = 2 * kMostPlanes - 4;

 private:
  struct Batch {
    std::size_t first, count;
  };

  void start_whole(const PairJob& job, const PairBuffers& buffers) const;

  bool double_;
  DeviceSolid& solid_;
  const OwnerPass& corners_;
  ExactRung& exact_;
  double batch_pairs_;
  std::vector<Index> starts_, marks_;
  std::vector<Batch> batches_;
  double expected_pairs_ = 0;
};

}  // namespace bisector::host
