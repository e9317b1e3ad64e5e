// Pairs of facets and cells: the restricted Voronoi diagram of a surface.
#pragma once

#include "host/passes/device_surface.h"
#include "host/passes/exact_rung.h"
#include "host/passes/owner_pass.h"
#include "host/passes/pair_pass.h"

namespace bisector::host {

// What a backend holds of its surface.
struct SurfaceBuffers {
  const Surface* surface = nullptr;
  std::vector<FacetChunk> facets;         // in the backend's precision
  std::vector<FacetChunk> double_facets;  // for the rung of double precision; may be empty
};

class FacetPairs : public PairDomain {
 public:
  // Pairs start from the owners of sites and, on large facets, of samples, which must have been found when pairs are.
  FacetPairs(Device& device, bool is_double, const SurfaceBuffers& surface, const OwnerPass& sites,
             const OwnerPass& samples, ExactRung& exact);

  // Batches and samples for the number of seeds; records the upload of what they say.
  void plan(Commands& commands, std::size_t seeds, double batch_pairs);
  const FacetSamples& samples() const { return plan_; }
  const Surface& surface() const { return *surface_.surface; }

  const char* elements() const override { return "triangles"; }
  bool is_solid() const override { return false; }
  double mean_density() const override { return surface().mass / surface().area; }
  bool double_next() const override { return !surface_.double_facets.empty(); }
  double expected_pairs() const override { return plan_.expected_pairs; }
  std::size_t batches() const override { return plan_.batches.size(); }
  std::size_t chunk_of(std::size_t batch) const override;
  void start(const PairJob& job, const PairBuffers& buffers, std::size_t batch) override;
  // Labels: for each pair the number of corners (or kNone where that is not certain) and as many labels.
  void clip(const PairJob& job, const PairBuffers& buffers, std::size_t chunk, const ClipKind& kind, ClipPush push,
            const Buffer& labels, const ClipDispatch& dispatch) override;
  std::vector<ExactPair> clip_exactly(const PairJob& job, const std::vector<PairName>& pairs) override;
  // The labels of polygons, in cyclic order.
  std::vector<std::vector<Index>> label_exactly(const std::vector<PairName>& pairs);

  static constexpr std::uint32_t kMostCorners = 16;

 private:
  bool double_;
  const SurfaceBuffers& surface_;
  const OwnerPass& sites_;
  const OwnerPass& owners_of_samples_;
  ExactRung& exact_;
  FacetSamples plan_;
  Buffer sample_facets_;
};

}  // namespace bisector::host
