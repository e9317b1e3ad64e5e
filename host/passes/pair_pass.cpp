#include "host/passes/pair_pass.h"

#include <fmt/format.h>

#include <algorithm>

#include "host/passes/packing.h"
#include "kernels/layout/pairs.h"
#include "kernels/layout/push.h"

namespace bisector::host {
namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);
constexpr int kRoundsPerRun = 6;  // of proposals and clipping, before the host looks again
constexpr uint kAsCounted = kNone;
// Pairs that there is memory for, in those that are expected: when it is asked for, and below which it is asked for
// anew.
constexpr double kCapacityMargin = 1.3, kLeastMargin = 1.1;
constexpr std::size_t kSpareCapacity = 4096;

uint word(std::size_t n) { return static_cast<uint>(n); }

// Of the bounds of cells' errors and the marks behind them.
std::size_t error_bytes(const PairJob& job) { return (kCellErrorWords + kMarkWords) * job.seeds.count() * kWord; }

// How many proposals there are, and the range of them that is worked on.
void clear_proposals(const PairJob& job) {
  job.commands.fill(job.counters, kProposals * kWord, (kProposalsEnd + 1 - kProposals) * kWord, 0);
}

}  // namespace

PairPass::PairPass(Device& device, bool is_double, const Capacities& capacities)
    : device_(device), double_(is_double), buffers_(device, capacities), gathered_(device), answers_(device),
      values_(device), first_capacity_(capacities.pairs),
      most_at_once_(static_cast<std::size_t>(2 * capacities.batch_pairs) + 64) {}

// As many as one binding spans the first moments of.
std::size_t PairPass::most_pairs() const {
  return std::min<std::size_t>(device_.limits().storage_range / (kFirstWords * real_size()), kNone - 1);
}

void PairPass::reserve(const PairJob& job) {
  const std::size_t real = real_size(), most = most_pairs();
  const double expected = job.domain.expected_pairs();
  PairStore& store = job.store;
  if (first_capacity_) {
    if (store.capacity == 0) store.capacity = first_capacity_;
  } else if (store.capacity < static_cast<std::size_t>(kLeastMargin * expected) + 1) {
    store.capacity = static_cast<std::size_t>(kCapacityMargin * expected) + kSpareCapacity;
  }
  if (store.capacity > most) {
    if (expected > static_cast<double>(most))
      throw DeviceError(
          fmt::format("{}: about {:.0f} pairs of cells and {} are more than its buffers hold; use fewer vertices",
                      device_.description().name, expected, job.domain.elements()));
    store.capacity = most;
  }
  store.pairs.reserve(store.capacity * sizeof(PairName));
  store.status.reserve(store.capacity * kWord);
  store.mass_second.reserve(store.capacity * kMassSecondWords * real);
  store.first.reserve(store.capacity * kFirstWords * real);
  buffers_.proposals.reserve(buffers_.proposal_capacity * sizeof(PairName));
  buffers_.table.reserve(buffers_.table_size * kWord);
  buffers_.flagged.reserve(kFlaggedLists * buffers_.table_size * kWord);
  buffers_.no_labels.reserve(kWord);
  buffers_.cell_errors.reserve(error_bytes(job));
}

void PairPass::run(const PairJob& job, Certification& certification) {
  for (;;) {
    reserve(job);
    certification = {};
    job.store.ranges.clear();
    job.store.count = 0;
    // Not those of the lists and owners, which the evaluation has found before.
    job.commands.fill(job.counters, kProposals * kWord, (kForCpu + 1 - kProposals) * kWord, 0);
    job.commands.fill(job.counters, kUnsurePairs * kWord, (kUnsureInDouble + 1 - kUnsurePairs) * kWord, 0);
    unsure_in_double_ = 0;
    job.commands.fill(buffers_.cell_errors, 0, error_bytes(job), 0);
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
      if (overflow & kOverflowProposals) buffers_.proposal_capacity *= 2;
      if (overflow & kOverflowTable) buffers_.table_size *= 2;
      if (overflow & kOverflowPairs) {
        const std::size_t most = most_pairs();
        if (job.store.capacity >= most)
          throw DeviceError(
              fmt::format("{}: more than {} pairs of cells and {}, which its buffers do not hold; use fewer vertices",
                          device_.description().name, most, job.domain.elements()));
        job.store.capacity = std::min(job.store.capacity * 2, most);
      }
      return false;
    }
    job.store.count = counters[kPairs];
    if (counters[kProposals] != counters[kProposalsEnd] || counters[kPairs] != counters[kPairsEnd]) continue;
    if (const std::size_t count = counters[kShortLists]) {
      certification.wider += count;
      job.neighbours.widen(job.commands, job.seeds, job.scan, buffers_.flagged, count, job.store.pairs,
                           counters[kWideTargets], job.counters);
      clip_flagged(job, chunk, kRungWide, kFlaggedShort, count);
      set_counter(job, kShortLists, 0);
    } else if (!climb(job, chunk, counters, certification)) {
      certification.uncertain = counters[kUnsurePairs];
      return true;
    }
  }
}

// Takes uncertain pairs to the next rung. False if there are none.
bool PairPass::climb(const PairJob& job, std::size_t chunk, const Counters& counters, Certification& certification) {
  if (const std::size_t count = counters[kUncertain]) {
    certification.doubled += count;
    clip_flagged(job, chunk, kRungDouble, kFlaggedUncertain, count);
    set_counter(job, kUncertain, 0);
    return true;
  }
  if (const std::size_t count = counters[kForCpu]) {
    certification.cpu += count;
    certification.doubled -= counters[kUnsureInDouble] - unsure_in_double_;
    unsure_in_double_ = counters[kUnsureInDouble];
    clip_exactly(job, counters);
    return true;
  }
  return false;
}

std::size_t PairPass::refine(const PairJob& job, const Buffer& cells, float share, Certification& certification) {
  std::size_t refined = 0;
  for (const PairStore::Range& range : job.store.ranges)
    // No more at once than the lists of flagged pairs hold.
    for (std::size_t first = range.begin; first < range.end; first += buffers_.table_size) {
      const DoubtfulPush push{word(first), word(std::min(buffers_.table_size, range.end - first)),
                              word(buffers_.table_size), static_cast<float>(job.domain.mean_density()), share};
      job.commands.phase(&DeviceSeconds::clip);
      clear_proposals(job);
      job.commands.dispatch({"doubtful", {job.domain.double_next(), job.domain.is_solid()}},
                            {reads(job.store.pairs), reads(job.store.status), reads(buffers_.cell_errors), reads(cells),
                             updates(job.counters), updates(buffers_.flagged)},
                            push, push.pair_count);
      Counters counters = read_counters(job);
      const std::size_t found = counters[kUncertain] + counters[kForCpu];
      refined += found;
      certification.uncertain += found;
      // What these pairs propose has been met before.
      while (climb(job, range.chunk, counters, certification)) {
        clear_proposals(job);
        counters = read_counters(job);
      }
    }
  job.commands.fill(job.counters, kOverflow * kWord, kWord, 0);
  return refined;
}

void PairPass::start(const PairJob& job, std::size_t batch) {
  job.commands.phase(&DeviceSeconds::clip);
  job.commands.fill(buffers_.table, 0, buffers_.table_size * kWord, 0);
  clear_proposals(job);
  job.domain.start(job, buffers_, batch);
  // What is a pair by now is not clipped.
  advance(job, true, kNone);
}

void PairPass::advance(const PairJob& job, bool of_pairs, std::size_t most) {
  const AdvancePush push{of_pairs, word(of_pairs ? job.store.capacity : buffers_.proposal_capacity),
                         device_.limits().groups, word(most)};
  job.commands.dispatch({"advance", {}}, {updates(job.counters)}, push, 1);
}

// Records rounds in which proposals become pairs, and pairs are clipped and propose more.
void PairPass::spread(const PairJob& job, std::size_t chunk) {
  const AdmitPush admit{word(buffers_.table_size - 1), word(job.store.capacity)};
  for (int round = 0; round < kRoundsPerRun; ++round) {
    advance(job, false, most_at_once_);
    job.commands.dispatch_indirect(
        {"admit", {}},
        {reads(buffers_.proposals), updates(buffers_.table), updates(job.store.pairs), updates(job.counters)}, admit,
        job.counters, kProposalGroups * kWord);
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
  push.two = kTwo;
  push.proposal_capacity = word(buffers_.proposal_capacity);
  push.flagged_capacity = word(buffers_.table_size);
  push.cell_count = word(job.seeds.count());
  job.commands.phase(&DeviceSeconds::clip);
  job.domain.clip(job, buffers_, chunk, kind, push, labels, dispatch);
}

void PairPass::clip_flagged(const PairJob& job, std::size_t chunk, uint rung, uint list, std::size_t count) {
  ClipPush push{};
  push.first_pair = word(list * buffers_.table_size);
  push.pair_count = word(count);
  clip(job, chunk, {rung, true, false}, push, buffers_.no_labels,
       [&](const Kernel& k, std::initializer_list<Binding> bindings, const ClipPush& p) {
         job.commands.dispatch(k, bindings, p, count);
       });
}

void PairPass::label(const PairJob& job, std::size_t chunk, std::size_t first, std::size_t count,
                     const Buffer& labels) {
  ClipPush push{};
  push.first_pair = word(first);
  push.pair_count = word(count);
  clip(job, chunk, {kRungFirst, false, true}, push, labels,
       [&](const Kernel& k, std::initializer_list<Binding> bindings, const ClipPush& p) {
         job.commands.dispatch(k, bindings, p, count);
       });
}

std::vector<Index> PairPass::marks(const PairJob& job) {
  std::vector<Index> marks(job.seeds.count());
  job.commands.download(buffers_.cell_errors, kCellErrorWords * job.seeds.count() * kWord, marks.data(),
                        marks.size() * kWord);
  job.commands.run();
  return marks;
}

Counters PairPass::read_counters(const PairJob& job) {
  Counters counters{};
  job.commands.download(job.counters, 0, counters.data(), sizeof counters);
  job.commands.run();
  return counters;
}

void PairPass::set_counter(const PairJob& job, uint counter, uint value) {
  job.commands.fill(job.counters, counter * kWord, kWord, value);
}

void PairPass::clip_exactly(const PairJob& job, const Counters& counters) {
  const std::size_t count = counters[kForCpu];
  Commands& commands = job.commands;
  gathered_.reserve(count * sizeof(GatheredPair));
  const GatherPairsPush gather{word(kFlaggedForCpu * buffers_.table_size), word(count)};
  commands.dispatch({"gather_pairs", {}}, {reads(buffers_.flagged), reads(job.store.pairs), writes(gathered_)}, gather,
                    count);
  std::vector<GatheredPair> gathered(count);
  commands.download(gathered_, 0, gathered.data(), count * sizeof(GatheredPair));
  commands.run();

  std::vector<PairName> names;
  for (const GatheredPair& pair : gathered) names.push_back(pair.name);
  const std::vector<ExactPair> pairs = job.domain.clip_exactly(job, names);

  std::vector<PairAnswer> answers;
  std::vector<PairName> proposals;
  RealWords values(double_);
  for (std::size_t k = 0; k < count; ++k) {
    answers.push_back({gathered[k].pair, pairs[k].empty ? kStatusEmpty : kStatusClipped});
    values.moments(pairs[k].moments);
    proposals.insert(proposals.end(), pairs[k].proposals.begin(), pairs[k].proposals.end());
  }
  upload(commands, answers_, answers);
  upload(commands, values_, values);
  commands.dispatch(kernel("store_answers", double_),
                    {reads(answers_), reads(values_), updates(job.store.status), updates(job.store.mass_second),
                     updates(job.store.first)},
                    CountPush{word(count)}, count);
  set_counter(job, kForCpu, 0);
  const std::size_t before = counters[kProposals], added = proposals.size();
  if (before + added > buffers_.proposal_capacity) {
    set_counter(job, kOverflow, kOverflowProposals);
  } else if (added) {
    commands.upload(buffers_.proposals, before * sizeof(PairName), proposals.data(), added * sizeof(PairName));
    set_counter(job, kProposals, word(before + added));
  }
}

}  // namespace bisector::host
