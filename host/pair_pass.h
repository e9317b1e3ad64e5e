// Incident pairs of facets and cells with their moments: clipping by batches of facets, from the owners of their corners
// outwards, and the rungs for what is not certain: wider lists, double precision, exact arithmetic.
#pragma once

#include <vector>

#include "bisector/voronoi/restricted.h"
#include "host/counters.h"
#include "host/device_surface.h"
#include "host/exact_rung.h"
#include "host/neighbour_pass.h"
#include "host/owner_pass.h"
#include "host/rooms.h"
#include "host/seeds.h"

namespace bisector::host {

// Pairs in the order in which they were met, which is not the same from run to run; their set is, and what is stored of each.
struct PairStore {
  explicit PairStore(Device& device) : pairs(device), status(device), mass_second(device), first(device) {}

  struct Range {
    std::size_t chunk, begin, end;
  };
  Buffer pairs;                // facet, slot
  Buffer status;               // of kernels/clipper.glsl
  Buffer mass_second, first;   // moments
  std::size_t room = 0, count = 0;
  std::vector<Range> ranges;   // of the batches
};

inline constexpr std::uint32_t kStatusClipped = 1, kStatusEmpty = 2, kStatusWhole = 6;

// What a backend holds of its surface.
struct SurfaceBuffers {
  const Surface* surface = nullptr;
  std::vector<FacetChunk> facets;         // in the backend's precision
  std::vector<FacetChunk> double_facets;  // for the rung of double precision; may be empty
};

// What a run of the pass reads and writes.
struct PairJob {
  Commands& commands;
  const SurfaceBuffers& surface;
  const DeviceSeeds& seeds;
  NeighbourPass& neighbours;
  const OwnerPass& sites;
  const OwnerPass& samples;
  const FacetSamples& plan;
  ExactRung& exact;
  Scan& scan;
  const Buffer& counters;
  PairStore& store;
};

// Push constants of kernels/clip.comp.
struct ClipPush {
  std::uint32_t facet_base;
  float residual;
  std::uint32_t two, first_pair, pair_count, proposal_room, flagged_room;
};

class PairPass {
 public:
  PairPass(Device& device, bool is_double, const Rooms& rooms);

  // Records the upload of what the plan says of samples.
  void set_plan(Commands& commands, const FacetSamples& plan);
  // Finds all pairs. The owners of sites and samples must have been found. Counts in `certification` what climbed which rung.
  void run(const PairJob& job, Certification& certification);
  // In single precision: takes the pairs of cells whose masses are not certain enough to the next rungs. `cells` are those of
  // CellPass, `share` the part that is allowed of the errors that usually are. Returns how many pairs there were.
  std::size_t refine(const PairJob& job, const Buffer& cells, float share, Certification& certification);
  // Records the clipping of `count` pairs from `first` on, of one batch, for their labels: for each the number of corners (or
  // kNone where that is not certain) and as many labels.
  void label(const PairJob& job, std::size_t chunk, std::size_t first, std::size_t count, const Buffer& labels);

  static constexpr std::uint32_t kMostCorners = 16;

 private:
  struct Kind;
  std::size_t real_size() const { return double_ ? sizeof(double) : sizeof(float); }
  std::size_t most_pairs() const;
  void make_room(const PairJob& job);
  bool climb(const PairJob& job, std::size_t chunk, const Counters& counters, Certification& certification);
  bool run_batch(const PairJob& job, const FacetBatch& batch, std::size_t chunk, Certification& certification);
  void start(const PairJob& job, const FacetBatch& batch, std::size_t chunk);
  void spread(const PairJob& job, std::size_t chunk);
  void advance(const PairJob& job, bool of_pairs);
  Counters read_counters(const PairJob& job);
  void set_counter(const PairJob& job, Counter counter, std::uint32_t value);
  void clip_flagged(const PairJob& job, std::size_t chunk, unsigned rung, unsigned region, std::size_t count);
  void settle_exactly(const PairJob& job, const Counters& counters);
  template <class Dispatch>
  void clip(const PairJob& job, std::size_t chunk, const Kind& kind, ClipPush push, const Buffer& labels,
            const Dispatch& dispatch);

  Device& device_;
  bool double_;
  Buffer proposals_, table_, flagged_, gathered_, settled_, values_, no_labels_, sample_facets_, doubts_;
  std::uint32_t unsettled_ = 0;  // pairs that double precision did not settle, as far as they are counted
  std::size_t proposal_room_, table_size_;
  std::size_t first_room_;  // of pairs, 0: by what is expected
};

}  // namespace bisector::host
