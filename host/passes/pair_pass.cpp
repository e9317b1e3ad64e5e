#include "host/passes/pair_pass.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/passes/packing.h"

namespace bisector::host {
namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);
constexpr int kRoundsPerRun = 6;           // of proposals and clipping, before the host looks again
constexpr std::uint32_t kAsCounted = kNone;

struct AdvancePush {
  std::uint32_t of_pairs, room, most_groups, most_items;
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

PairPass::PairPass(Device& device, bool is_double, const Rooms& rooms)
    : device_(device), double_(is_double), buffers_(device, rooms), gathered_(device), settled_(device), values_(device),
      first_room_(rooms.pairs), most_at_once_(static_cast<std::size_t>(2 * rooms.batch_pairs) + 64) {}

// As many as there is room for first moments in one binding.
std::size_t PairPass::most_pairs() const {
  return std::min<std::size_t>(device_.limits().storage_range / (3 * real_size()), kNone - 1);
}

void PairPass::make_room(const PairJob& job) {
  const std::size_t real = real_size(), most = most_pairs();
  const double expected = job.domain.expected_pairs();
  PairStore& store = job.store;
  if (first_room_) {
    if (store.room == 0) store.room = first_room_;
  } else if (store.room < static_cast<std::size_t>(1.1 * expected) + 1) {
    store.room = static_cast<std::size_t>(1.3 * expected) + 4096;
  }
  if (store.room > most) {
    if (expected > static_cast<double>(most))
      throw DeviceError(fmt::format("{}: about {:.0f} pairs of cells and {} are more than its buffers hold; use "
                                    "--device cpu, or fewer vertices",
                                    device_.description().name, expected, job.domain.elements()));
    store.room = most;
  }
  store.pairs.reserve(store.room * 2 * kWord);
  store.status.reserve(store.room * kWord);
  store.mass_second.reserve(store.room * 2 * real);
  store.first.reserve(store.room * 3 * real);
  buffers_.proposals.reserve(buffers_.proposal_room * 2 * kWord);
  buffers_.table.reserve(buffers_.table_size * kWord);
  buffers_.flagged.reserve(3 * buffers_.table_size * kWord);
  buffers_.no_labels.reserve(kWord);
  buffers_.doubts.reserve(3 * job.seeds.count() * kWord);
}

void PairPass::run(const PairJob& job, Certification& certification) {
  for (;;) {
    make_room(job);
    certification = {};
    job.store.ranges.clear();
    job.store.count = 0;
    job.commands.fill(job.counters, 0, (kForCpu + 1) * kWord, 0);
    job.commands.fill(job.counters, kUnsureMet * kWord, 2 * kWord, 0);
    unsettled_ = 0;
    job.commands.fill(buffers_.doubts, 0, 3 * job.seeds.count() * kWord, 0);
    bool complete = true;
    for (std::size_t batch = 0; complete && batch < job.domain.batches(); ++batch) {
      const std::size_t begin = job.store.count;
      complete = run_batch(job, batch, certification);
      job.store.ranges.push_back({job.domain.chunk_of(batch), begin, job.store.count});
    }
    if (complete) return;
  }
}

// False if some buffer was too small: then it is larger now, and all has to be done again.
bool PairPass::run_batch(const PairJob& job, std::size_t batch, Certification& certification) {
  const std::size_t chunk = job.domain.chunk_of(batch);
  start(job, batch);
  for (;;) {
    spread(job, chunk);
    const Counters counters = read_counters(job);
    if (const std::uint32_t overflow = counters[kOverflow]) {
      if (overflow & kOverflowProposals) buffers_.proposal_room *= 2;
      if (overflow & kOverflowTable) buffers_.table_size *= 2;
      if (overflow & kOverflowPairs) {
        const std::size_t most = most_pairs();
        if (job.store.room >= most)
          throw DeviceError(fmt::format("{}: more than {} pairs of cells and {}, which its buffers do not hold; use "
                                        "--device cpu, or fewer vertices",
                                        device_.description().name, most, job.domain.elements()));
        job.store.room = std::min(job.store.room * 2, most);
      }
      return false;
    }
    job.store.count = counters[kPairs];
    if (counters[kProposals] != counters[kProposalsEnd] || counters[kPairs] != counters[kPairsEnd]) continue;
    if (const std::size_t count = counters[kShort]) {
      certification.wider += count;
      job.neighbours.widen(job.commands, job.seeds, job.scan, buffers_.flagged, count, job.store.pairs,
                           counters[kTargetCount], job.counters);
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
  for (const PairStore::Range& range : job.store.ranges)
    // No more at once than the lists of flagged pairs hold.
    for (std::size_t first = range.begin; first < range.end; first += buffers_.table_size) {
      const DoubtfulPush push{word(first), word(std::min(buffers_.table_size, range.end - first)), word(buffers_.table_size),
                              static_cast<float>(job.domain.mean_density()), share};
      job.commands.phase(Phase::clip);
      job.commands.fill(job.counters, kProposals * kWord, 3 * kWord, 0);
      job.commands.dispatch({"doubtful", {job.domain.double_next(), job.domain.is_solid()}},
                            {reads(job.store.pairs), reads(job.store.status), reads(buffers_.doubts), reads(cells),
                             updates(job.counters), updates(buffers_.flagged)},
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

void PairPass::start(const PairJob& job, std::size_t batch) {
  job.commands.phase(Phase::clip);
  job.commands.fill(buffers_.table, 0, buffers_.table_size * kWord, 0);
  job.commands.fill(job.counters, kProposals * kWord, 3 * kWord, 0);
  job.domain.start(job, buffers_, batch);
  // What is a pair by now is not clipped.
  advance(job, true, kNone);
}

void PairPass::advance(const PairJob& job, bool of_pairs, std::size_t most) {
  const AdvancePush push{of_pairs, word(of_pairs ? job.store.room : buffers_.proposal_room), device_.limits().groups,
                         word(most)};
  job.commands.dispatch({"advance", {}}, {updates(job.counters)}, push, 1);
}

// Records rounds in which proposals become pairs, and pairs are clipped and propose more.
void PairPass::spread(const PairJob& job, std::size_t chunk) {
  const AdmitPush admit{word(buffers_.table_size - 1), word(job.store.room)};
  for (int round = 0; round < kRoundsPerRun; ++round) {
    advance(job, false, most_at_once_);
    job.commands.dispatch_indirect({"admit", {}},
                                   {reads(buffers_.proposals), updates(buffers_.table), updates(job.store.pairs),
                                    updates(job.counters)},
                                   admit, job.counters, kProposalGroups * kWord);
    advance(job, true, most_at_once_);
    ClipPush push{};
    push.pair_count = kAsCounted;
    clip(job, chunk, {}, push, buffers_.no_labels,
         [&](const Kernel& k, std::initializer_list<Binding> bindings, const ClipPush& p) {
           job.commands.dispatch_indirect(k, bindings, p, job.counters, kPairGroups * kWord);
         });
  }
}

void PairPass::clip(const PairJob& job, std::size_t chunk, const ClipKind& kind, ClipPush push, const Buffer& labels,
                    const ClipDispatch& dispatch) {
  push.residual = job.seeds.residual;
  push.two = 2;
  push.proposal_room = word(buffers_.proposal_room);
  push.flagged_room = word(buffers_.table_size);
  push.cells = word(job.seeds.count());
  job.commands.phase(Phase::clip);
  job.domain.clip(job, buffers_, chunk, kind, push, labels, dispatch);
}

void PairPass::clip_flagged(const PairJob& job, std::size_t chunk, unsigned rung, unsigned region, std::size_t count) {
  ClipPush push{};
  push.first_pair = word(region * buffers_.table_size);
  push.pair_count = word(count);
  clip(job, chunk, {rung, true, false}, push, buffers_.no_labels,
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
  const GatherPush gather{word(2 * buffers_.table_size), word(count)};
  commands.dispatch({"gather", {}}, {reads(buffers_.flagged), reads(job.store.pairs), writes(gathered_)}, gather, count);
  std::vector<Index> gathered(3 * count);
  commands.download(gathered_, 0, gathered.data(), gathered.size() * kWord);
  commands.run();

  std::vector<PairName> names(count);
  for (std::size_t k = 0; k < count; ++k) names[k] = {gathered[3 * k + 1], gathered[3 * k + 2]};
  const std::vector<ExactPair> pairs = job.domain.clip_exactly(job, names);

  std::vector<std::uint32_t> settled, proposals;
  RealWords values(double_);
  for (std::size_t k = 0; k < count; ++k) {
    settled.insert(settled.end(), {gathered[3 * k], pairs[k].empty ? kStatusEmpty : kStatusClipped});
    values.moments(pairs[k].moments);
    for (const PairName& proposal : pairs[k].proposals) proposals.insert(proposals.end(), {proposal.element, proposal.slot});
  }
  upload(commands, settled_, settled);
  upload(commands, values_, values);
  commands.dispatch(kernel("settle", double_),
                    {reads(settled_), reads(values_), updates(job.store.status), updates(job.store.mass_second),
                     updates(job.store.first)},
                    word(count), count);
  set_counter(job, kForCpu, 0);
  const std::size_t before = counters[kProposals], added = proposals.size() / 2;
  if (before + added > buffers_.proposal_room) {
    set_counter(job, kOverflow, kOverflowProposals);
  } else if (added) {
    commands.upload(buffers_.proposals, before * 2 * kWord, proposals.data(), proposals.size() * kWord);
    set_counter(job, kProposals, word(before + added));
  }
}

}  // namespace bisector::host
