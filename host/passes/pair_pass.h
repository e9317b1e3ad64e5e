// Incident pairs of elements (facets of a surface, tetrahedra of a solid) and cells, with their moments: clipping by
// batches of elements, from a few certain pairs outwards, and the rungs for what is not certain: wider lists, double
// precision, exact arithmetic.
#pragma once

#include <array>
#include <functional>
#include <initializer_list>
#include <vector>

#include "host/passes/capacities.h"
#include "host/passes/neighbour_pass.h"
#include "host/passes/seeds.h"
#include "kernels/layout/counters.h"
#include "kernels/layout/pairs.h"
#include "kernels/layout/push.h"
#include "voronoi/restricted.h"

namespace bisector::host {

// Pairs in the order in which they were met, which is not the same from run to run; their set is, and what is stored of
// each.
struct PairStore {
  explicit PairStore(Device& device) : pairs(device), status(device), mass_second(device), first(device) {}

  struct Range {
    std::size_t chunk, begin, end;
  };
  Buffer pairs;               // PairName
  Buffer status;              // kStatus... of kernels/layout/pairs.h
  Buffer mass_second, first;  // moments
  std::size_t capacity = 0, count = 0;
  std::vector<Range> ranges;  // of the batches
};

// What exact arithmetic on the CPU found for a pair.
struct ExactPair {
  bool empty = true;
  Moments moments;                  // in lengths of the device
  std::vector<PairName> proposals;  // the pairs that it makes known
};

class PairDomain;

// What a run of the pass reads and writes.
struct PairJob {
  Commands& commands;
  const DeviceSeeds& seeds;
  NeighbourPass& neighbours;
  const Buffer& counters;
  PairStore& store;
  PairDomain& domain;
};

// What the pass keeps between its dispatches.
struct PairBuffers {
  PairBuffers(Device& device, const Capacities& capacities)
      : proposals(device), table(device), flagged(device), cell_errors(device), no_labels(device),
        proposal_capacity(capacities.proposals), table_size(capacities.table), flagged_capacity(capacities.flagged) {}

  Buffer proposals;    // PairName
  Buffer table;        // the set of the pairs of a batch
  Buffer flagged;      // lists of pairs
  Buffer cell_errors;  // bounds of the errors of cells, then marks of cells
  Buffer no_labels;    // bound where none are asked for
  std::size_t proposal_capacity, table_size, flagged_capacity;
};

// Which specialisation of a clip kernel.
struct ClipKind {
  uint rung = kRungFirst;
  bool listed = false, labels = false;
};

using ClipDispatch = std::function<void(const Kernel&, std::initializer_list<Binding>, const ClipPush&)>;

// What pairs are made of beside cells, and how one is clipped.
class PairDomain {
 public:
  virtual ~PairDomain() = default;

  virtual const char* elements() const = 0;  // for messages: "triangles"
  virtual bool is_solid() const = 0;         // masses are volumes
  virtual double mean_density() const = 0;
  virtual bool double_next() const = 0;  // whether single precision may hand pairs to the double kernels
  virtual double expected_pairs() const = 0;
  virtual std::size_t batches() const = 0;
  virtual std::size_t chunk_of(std::size_t batch) const = 0;  // the part of the elements that one binding spans
  // Records the first pairs and proposals of a batch.
  virtual void start(const PairJob& job, const PairBuffers& buffers, std::size_t batch) = 0;
  // Dispatches the kernel for pairs of a chunk. `push` says which.
  virtual void clip(const PairJob& job, const PairBuffers& buffers, std::size_t chunk, const ClipKind& kind,
                    ClipPush push, const Buffer& labels, const ClipDispatch& dispatch) = 0;
  virtual std::vector<ExactPair> clip_exactly(const PairJob& job, const std::vector<PairName>& pairs) = 0;
};

// How many pairs a batch should have, so that its buffers fit into the device's bindings and memory; `asked` if that is
// not 0.
double batch_pairs_of(const Device& device, double asked);

class PairPass {
 public:
  PairPass(Device& device, bool is_double, const Capacities& capacities);

  // Finds all pairs. Counts in `certification` what climbed which rung.
  void run(const PairJob& job, Certification& certification);
  // How long the device took to clip so many pairs: dispatches follow that, lest a desktop's watchdog ends them.
  void learn_speed(std::size_t pairs, double seconds);
  // In single precision: takes the pairs of cells whose masses are not certain enough to the next rungs. `cells` are
  // those of CellPass, `share` the part that is allowed of the errors that usually are. Returns how many pairs there
  // were.
  std::size_t refine(const PairJob& job, const Buffer& cells, float share, Certification& certification);
  // The marks that the last run has left on each slot.
  std::vector<Index> marks(const PairJob& job);
  // Records the clipping of `count` pairs from `first` on, of one batch, for their labels.
  void label(const PairJob& job, std::size_t chunk, std::size_t first, std::size_t count, const Buffer& labels);

 private:
  std::size_t real_size() const { return double_ ? sizeof(double) : sizeof(float); }
  std::size_t most_pairs() const;
  void reserve(const PairJob& job);
  void reserve_flagged();
  std::size_t most_gathered() const;
  void grow(const PairJob& job, const Counters& counters);
  std::size_t refine(const PairJob& job, const PairStore::Range& range, const Buffer& cells, float share,
                     Certification& certification);
  bool run_batch(const PairJob& job, std::size_t batch, Certification& certification);
  void start(const PairJob& job, std::size_t batch);
  void spread(const PairJob& job, std::size_t chunk, int rounds);
  void climb(const PairJob& job, std::size_t chunk);
  void climb_in_double(const PairJob& job, std::size_t chunk);
  void advance(const PairJob& job, uint kind, std::size_t capacity, std::size_t most);
  void clear_lists(const PairJob& job);
  Counters gather_and_count(const PairJob& job);
  void clip_listed(const PairJob& job, std::size_t chunk, uint rung, uint list);
  void answer(const PairJob& job, const Counters& counters);
  void count_lists(const Counters& counters, Certification& certification);
  void clip(const PairJob& job, std::size_t chunk, const ClipKind& kind, ClipPush push, const Buffer& labels,
            const ClipDispatch& dispatch);

  Device& device_;
  bool double_;
  Capacities asked_;
  PairBuffers buffers_;
  Buffer gathered_, answers_, values_;
  std::vector<GatheredPair> for_cpu_;  // that were gathered last
  std::size_t expect_for_cpu_;         // how many are downloaded before it is known how many there are
  uint unsure_in_double_ = 0;          // pairs that double precision left uncertain, as far as they are counted
  int rounds_;                         // before the first climb
  std::size_t at_once_;                // pairs or proposals of one dispatch
};

}  // namespace bisector::host
