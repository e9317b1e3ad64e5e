#include "host/pair_pass.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/packing.h"

namespace bisector::host {
namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);
constexpr int kRoundsPerRun = 6;           // of proposals and clipping, before the host looks again
constexpr std::uint32_t kWideCorners = 48;
constexpr std::uint32_t kAsCounted = kNone;

struct StartPush {
  std::uint32_t facet_base, first_facet, facet_count, proposal_room, pair_room;
};
struct SamplesPush {
  std::uint32_t facet_base, first, count, proposal_room;
};
struct AdvancePush {
  std::uint32_t of_pairs, room, most_groups;
};
struct AdmitPush {
  std::uint32_t table_mask, pair_room;
};
struct DoubtfulPush {
  std::uint32_t first, count, flagged_room;
  float mean_density, share;
};
struct GatherPush {
  std::uint32_t first, count;
};

std::uint32_t word(std::size_t n) { return static_cast<std::uint32_t>(n); }

}  // namespace

// Which specialisation of the clip kernel.
struct PairPass::Kind {
  unsigned rung = 0;
  bool listed = false, labels = false;
};

PairPass::PairPass(Device& device, bool is_double, const Rooms& rooms)
    : device_(device), double_(is_double), proposals_(device), table_(device), flagged_(device), gathered_(device),
      settled_(device), values_(device), no_labels_(device), sample_facets_(device), doubts_(device),
      proposal_room_(rooms.proposals), table_size_(rooms.table), first_room_(rooms.pairs) {}

void PairPass::set_plan(Commands& commands, const FacetSamples& plan) { upload(commands, sample_facets_, plan.facets); }

// As many as there is room for first moments in one binding.
std::size_t PairPass::most_pairs() const {
  return std::min<std::size_t>(device_.limits().storage_range / (3 * real_size()), kNone - 1);
}

void PairPass::make_room(const PairJob& job) {
  const std::size_t real = real_size(), most = most_pairs();
  PairStore& store = job.store;
  if (first_room_) {
    if (store.room == 0) store.room = first_room_;
  } else if (store.room < static_cast<std::size_t>(1.1 * job.plan.expected_pairs) + 1) {
    store.room = static_cast<std::size_t>(1.3 * job.plan.expected_pairs) + 4096;
  }
  if (store.room > most) {
    if (job.plan.expected_pairs > static_cast<double>(most))
      throw DeviceError(fmt::format("{}: about {:.0f} pairs of cells and triangles are more than its buffers hold; use "
                                    "--device cpu, or fewer vertices",
                                    device_.description().name, job.plan.expected_pairs));
    store.room = most;
  }
  store.pairs.reserve(store.room * 2 * kWord);
  store.status.reserve(store.room * kWord);
  store.mass_second.reserve(store.room * 2 * real);
  store.first.reserve(store.room * 3 * real);
  proposals_.reserve(proposal_room_ * 2 * kWord);
  table_.reserve(table_size_ * kWord);
  flagged_.reserve(3 * table_size_ * kWord);
  no_labels_.reserve(kWord);
  doubts_.reserve(2 * job.seeds.count() * kWord);
  if (sample_facets_.size() == 0) sample_facets_.reserve(kWord);
}

void PairPass::run(const PairJob& job, Certification& certification) {
  set_counter(job, kTargetCount, 0);
  for (;;) {
    make_room(job);
    certification = {};
    job.store.ranges.clear();
    job.store.count = 0;
    job.commands.fill(job.counters, 0, (kForCpu + 1) * kWord, 0);
    job.commands.fill(job.counters, kUnsureMet * kWord, 2 * kWord, 0);
    unsettled_ = 0;
    job.commands.fill(doubts_, 0, 2 * job.seeds.count() * kWord, 0);
    bool complete = true;
    std::size_t chunk = 0;
    for (const FacetBatch& batch : job.plan.batches) {
      while (batch.first >= job.surface.facets[chunk].first + job.surface.facets[chunk].count) ++chunk;
      const std::size_t begin = job.store.count;
      complete = run_batch(job, batch, chunk, certification);
      if (!complete) break;
      job.store.ranges.push_back({chunk, begin, job.store.count});
    }
    if (complete) return;
  }
}

// False if some buffer was too small: then it is larger now, and all has to be done again.
bool PairPass::run_batch(const PairJob& job, const FacetBatch& batch, std::size_t chunk, Certification& certification) {
  start(job, batch, chunk);
  for (;;) {
    spread(job, chunk);
    const Counters counters = read_counters(job);
    if (const std::uint32_t overflow = counters[kOverflow]) {
      if (overflow & kOverflowProposals) proposal_room_ *= 2;
      if (overflow & kOverflowTable) table_size_ *= 2;
      if (overflow & kOverflowPairs) {
        const std::size_t most = most_pairs();
        if (job.store.room >= most)
          throw DeviceError(fmt::format("{}: more than {} pairs of cells and triangles, which its buffers do not hold; use "
                                        "--device cpu, or fewer vertices",
                                        device_.description().name, most));
        job.store.room = std::min(job.store.room * 2, most);
      }
      return false;
    }
    job.store.count = counters[kPairs];
    if (counters[kProposals] != counters[kProposalsEnd]) continue;
    if (const std::size_t count = counters[kShort]) {
      certification.wider += count;
      job.neighbours.widen(job.commands, job.seeds, job.scan, flagged_, count, job.store.pairs, counters[kTargetCount],
                           job.counters);
      clip_flagged(job, chunk, 1, 0, count);
      set_counter(job, kShort, 0);
    } else if (!climb(job, chunk, counters, certification)) {
      certification.uncertain = counters[kUnsureMet];
      return true;
    }
  }
}

// Takes uncertain pairs to the next rung. False if there are none.
bool PairPass::climb(const PairJob& job, std::size_t chunk, const Counters& counters, Certification& certification) {
  if (const std::size_t count = counters[kUncertain]) {
    certification.doubled += count;
    clip_flagged(job, chunk, 2, 1, count);
    set_counter(job, kUncertain, 0);
    return true;
  }
  if (const std::size_t count = counters[kForCpu]) {
    certification.cpu += count;
    certification.doubled -= counters[kUnsettled] - unsettled_;
    unsettled_ = counters[kUnsettled];
    settle_exactly(job, counters);
    return true;
  }
  return false;
}

std::size_t PairPass::refine(const PairJob& job, const Buffer& cells, float share, Certification& certification) {
  std::size_t refined = 0;
  const bool double_next = !job.surface.double_facets.empty();
  for (const PairStore::Range& range : job.store.ranges)
    // No more at once than the lists of flagged pairs hold.
    for (std::size_t first = range.begin; first < range.end; first += table_size_) {
      const DoubtfulPush push{word(first), word(std::min(table_size_, range.end - first)), word(table_size_),
                              static_cast<float>(job.surface.surface->mass / job.surface.surface->area), share};
      job.commands.phase(Phase::clip);
      job.commands.fill(job.counters, kProposals * kWord, 3 * kWord, 0);
      job.commands.dispatch({"doubtful", {double_next}},
                            {reads(job.store.pairs), reads(job.store.status), reads(doubts_), reads(cells), updates(job.counters),
                             updates(flagged_)},
                            push, push.count);
      Counters counters = read_counters(job);
      const std::size_t found = counters[kUncertain] + counters[kForCpu];
      refined += found;
      certification.uncertain += found;
      // What these pairs propose has been met before.
      while (climb(job, range.chunk, counters, certification)) {
        job.commands.fill(job.counters, kProposals * kWord, 3 * kWord, 0);
        counters = read_counters(job);
      }
    }
  job.commands.fill(job.counters, kOverflow * kWord, kWord, 0);
  return refined;
}

void PairPass::start(const PairJob& job, const FacetBatch& batch, std::size_t chunk) {
  const FacetChunk& facets = job.surface.facets[chunk];
  const PairStore& store = job.store;
  Commands& commands = job.commands;
  commands.phase(Phase::clip);
  commands.fill(table_, 0, table_size_ * kWord, 0);
  commands.fill(job.counters, kProposals * kWord, 3 * kWord, 0);
  const StartPush push{word(facets.first), word(batch.first), word(batch.count), word(proposal_room_), word(store.room)};
  commands.dispatch(kernel("start", double_),
                    {reads(job.seeds.words), reads(facets.words), reads(facets.meta), reads(facets.wholes),
                     reads(job.sites.owners()), updates(store.pairs), updates(store.status), updates(store.mass_second),
                     updates(store.first), writes(proposals_), updates(job.counters)},
                    push, batch.count);
  if (batch.sample_count) {
    const SamplesPush samples{word(facets.first), word(batch.first_sample), word(batch.sample_count), word(proposal_room_)};
    commands.dispatch({"start_samples", {}},
                      {reads(sample_facets_), reads(job.samples.owners()), updates(proposals_), updates(job.counters),
                       reads(job.sites.owners()), reads(facets.meta)},
                      samples, batch.sample_count);
  }
  // Whole facets are pairs already; what follows starts after them.
  advance(job, true);
}

void PairPass::advance(const PairJob& job, bool of_pairs) {
  const AdvancePush push{of_pairs, word(of_pairs ? job.store.room : proposal_room_), device_.limits().groups};
  job.commands.dispatch({"advance", {}}, {updates(job.counters)}, push, 1);
}

// Records rounds in which proposals become pairs, and pairs are clipped and propose more.
void PairPass::spread(const PairJob& job, std::size_t chunk) {
  const AdmitPush admit{word(table_size_ - 1), word(job.store.room)};
  for (int round = 0; round < kRoundsPerRun; ++round) {
    advance(job, false);
    job.commands.dispatch_indirect({"admit", {}},
                                   {reads(proposals_), updates(table_), updates(job.store.pairs), updates(job.counters)}, admit,
                                   job.counters, kProposalGroups * kWord);
    advance(job, true);
    ClipPush push{};
    push.pair_count = kAsCounted;
    clip(job, chunk, {}, push, no_labels_, [&](const Kernel& k, std::initializer_list<Binding> bindings, const ClipPush& p) {
      job.commands.dispatch_indirect(k, bindings, p, job.counters, kPairGroups * kWord);
    });
  }
}

template <class Dispatch>
void PairPass::clip(const PairJob& job, std::size_t chunk, const Kind& kind, ClipPush push, const Buffer& labels,
                    const Dispatch& dispatch) {
  const bool doubled = kind.rung == 2;
  const FacetChunk& facets = (doubled ? job.surface.double_facets : job.surface.facets)[chunk];
  push.facet_base = word(facets.first);
  push.residual = job.seeds.residual;
  push.two = 2;
  push.proposal_room = word(proposal_room_);
  push.flagged_room = word(table_size_);
  const bool double_next = !doubled && !job.surface.double_facets.empty();
  const std::uint32_t corners = kind.labels || kind.rung == 0 ? kMostCorners : kWideCorners;
  const PairStore& store = job.store;
  job.commands.phase(Phase::clip);
  dispatch(kernel("clip", double_ || doubled,
                  {corners, job.surface.surface->density.empty(), kind.rung, kind.listed, kind.labels, doubled, double_next}),
           {reads(doubled ? job.seeds.doubles : job.seeds.words), reads(job.seeds.ids), reads(facets.words),
            reads(facets.meta), reads(job.neighbours.info()), updates(doubts_), reads(job.neighbours.lists()),
            reads(job.neighbours.wide_lists()), reads(store.pairs), updates(store.status), updates(store.mass_second),
            updates(store.first), updates(proposals_), updates(job.counters), updates(flagged_), writes(labels)},
           push);
}

void PairPass::clip_flagged(const PairJob& job, std::size_t chunk, unsigned rung, unsigned region, std::size_t count) {
  ClipPush push{};
  push.first_pair = word(region * table_size_);
  push.pair_count = word(count);
  clip(job, chunk, {rung, true, false}, push, no_labels_,
       [&](const Kernel& k, std::initializer_list<Binding> bindings, const ClipPush& p) {
         job.commands.dispatch(k, bindings, p, count);
       });
}

void PairPass::label(const PairJob& job, std::size_t chunk, std::size_t first, std::size_t count, const Buffer& labels) {
  ClipPush push{};
  push.first_pair = word(first);
  push.pair_count = word(count);
  clip(job, chunk, {0, false, true}, push, labels,
       [&](const Kernel& k, std::initializer_list<Binding> bindings, const ClipPush& p) {
         job.commands.dispatch(k, bindings, p, count);
       });
}

Counters PairPass::read_counters(const PairJob& job) {
  Counters counters{};
  job.commands.download(job.counters, 0, counters.data(), sizeof counters);
  job.commands.run();
  return counters;
}

void PairPass::set_counter(const PairJob& job, Counter counter, std::uint32_t value) {
  job.commands.fill(job.counters, counter * kWord, kWord, value);
}

void PairPass::settle_exactly(const PairJob& job, const Counters& counters) {
  const std::size_t count = counters[kForCpu];
  Commands& commands = job.commands;
  gathered_.reserve(3 * count * kWord);
  const GatherPush gather{word(2 * table_size_), word(count)};
  commands.dispatch({"gather", {}}, {reads(flagged_), reads(job.store.pairs), writes(gathered_)}, gather, count);
  std::vector<Index> gathered(3 * count);
  commands.download(gathered_, 0, gathered.data(), gathered.size() * kWord);
  commands.run();

  std::vector<ExactRung::Item> items(count);
  for (std::size_t k = 0; k < count; ++k) items[k] = {gathered[3 * k + 1], gathered[3 * k + 2]};
  const std::vector<ExactPolygon> polygons = job.exact.clip(items);

  std::vector<std::uint32_t> settled, proposals;
  RealWords values(double_);
  for (std::size_t k = 0; k < count; ++k) {
    const ExactPolygon& polygon = polygons[k];
    settled.insert(settled.end(), {gathered[3 * k], polygon.empty ? kStatusEmpty : kStatusClipped});
    values.moments(scaled(polygon.moments, job.seeds.scale));
    for (const Index label : polygon.labels)
      if (!is_edge(label)) proposals.insert(proposals.end(), {items[k].facet, label});
  }
  upload(commands, settled_, settled);
  upload(commands, values_, values);
  commands.dispatch(kernel("settle", double_),
                    {reads(settled_), reads(values_), updates(job.store.status), updates(job.store.mass_second),
                     updates(job.store.first)},
                    word(count), count);
  set_counter(job, kForCpu, 0);
  const std::size_t before = counters[kProposals], added = proposals.size() / 2;
  if (before + added > proposal_room_) {
    set_counter(job, kOverflow, kOverflowProposals);
  } else if (added) {
    commands.upload(proposals_, before * 2 * kWord, proposals.data(), proposals.size() * kWord);
    set_counter(job, kProposals, word(before + added));
  }
}

}  // namespace bisector::host
