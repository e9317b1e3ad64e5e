// Pairs of tetrahedra and cells: the clipped Voronoi diagram of a solid.
#pragma once

#include "host/passes/device_solid.h"
#include "host/passes/exact_rung.h"
#include "host/passes/owner_pass.h"
#include "host/passes/pair_pass.h"

namespace bisector::host {

class TetPairs : public PairDomain {
 public:
  // With `inner_whole` cells that do not meet the boundary are pairs of the enclosure, and pairs start from those of
  // the boundary; else they start from the owners of the vertices.
  TetPairs(bool is_double, DeviceSolid& solid, const OwnerPass& corners, ExactRung& exact, bool inner_whole,
           double batch_pairs);

  // The pairs of the boundary's facets, and the triangles of each of the `cells` cells.
  void set_shell(const PairStore& pairs, const CellMoments& moments, std::size_t cells);
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

  bool double_;
  DeviceSolid& solid_;
  const OwnerPass& corners_;
  ExactRung& exact_;
  bool inner_whole_;
  double batch_pairs_;
  const PairStore* shell_ = nullptr;
  const CellMoments* shell_moments_ = nullptr;
  std::vector<Batch> batches_;
  double expected_pairs_ = 0;
};

}  // namespace bisector::host
