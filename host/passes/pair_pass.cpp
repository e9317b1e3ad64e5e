#include "host/passes/pair_pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "host/passes/packing.h"
#include "kernels/layout/pairs.h"
#include "kernels/layout/push.h"

namespace bisector::host {
namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);
// Before the host looks again there are rounds of proposals and clipping, then a few climbs to the next rungs, with
// rounds after each, for what climbs makes others known, some of which climb in turn.
constexpr int kLeastRounds = 3, kMostRounds = 8, kClimbs = 3, kRoundsAfterClimb = 2;
// Pairs that there is memory for, in those that are expected: when it is asked for, and below which it is asked for
// anew.
constexpr double kCapacityMargin = 1.3, kLeastMargin = 1.1;
constexpr std::size_t kSpareCapacity = 4096;
// Of a batch, per pair that is expected: proposals, entries of the table, and a share that climbs some rung.
constexpr double kProposalsPerPair = 6, kTablePerPair = 1.7, kFlaggedPerPair = 0.1;
constexpr double kBytesPerPair = 80;     // of a batch and of the pairs themselves
constexpr double kShareOfMemory = 0.25;  // of the device's, for a batch
// Pairs of one dispatch: until the device's speed is known, and for how many seconds once it is.
constexpr std::size_t kFirstAtOnce = std::size_t{1} << 17;
constexpr double kSecondsAtOnce = 0.1;
constexpr std::size_t kGatheredAtOnce = std::size_t{1} << 16;  // pairs that the CPU is asked about
constexpr std::size_t kLeastExpected = 16;                     // of them, which come down with the counters

uint word(std::size_t n) { return static_cast<uint>(n); }

// Of the bounds of cells' errors and the marks behind them.
std::size_t error_bytes(const PairJob& job) { return (kCellErrorWords + kMarkWords) * job.seeds.count() * kWord; }

void clear_work(const PairJob& job, uint first_counter, uint kinds) {
  job.commands.fill(job.counters, first_counter * kWord, kinds * kWorkWords * kWord, 0);
}

// Whether some of that kind were left for a later dispatch.
bool are_left(const Counters& counters, uint counter) { return counters[counter] > counters[counter + kEndAfter]; }

}  // namespace

double batch_pairs_of(const Device& device, double asked) {
  if (asked > 0) return asked;
  const double by_range = static_cast<double>(device.limits().storage_range) / (kProposalsPerPair * sizeof(PairName));
  const double by_memory = kShareOfMemory * static_cast<double>(device.description().memory) / kBytesPerPair;
  return std::max(65536.0, 0.9 * std::min(by_range, by_memory));
}

PairPass::PairPass(Device& device, bool is_double, const Capacities& capacities)
    : device_(device), double_(is_double), asked_(capacities), buffers_(device, capacities), gathered_(device),
      answers_(device), values_(device), expect_for_cpu_(kLeastExpected), rounds_(kMostRounds),
      at_once_(capacities.at_once                        ? capacities.at_once
               : device.description().kind == "software" ? std::size_t{kNone - 1}
                                                         : kFirstAtOnce) {}

// As many as one binding spans the first moments of.
std::size_t PairPass::most_pairs() const {
  return std::min<std::size_t>(device_.limits().storage_range / (kFirstWords * real_size()), kAgainInDouble - 1);
}

void PairPass::reserve(const PairJob& job) {
  const std::size_t real = real_size(), most = most_pairs();
  const double expected = job.domain.expected_pairs();
  PairStore& store = job.store;
  if (asked_.pairs) {
    if (store.capacity == 0) store.capacity = asked_.pairs;
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

  const double in_batch =
      std::min(expected, 1.1 * batch_pairs_of(device_, asked_.batch_pairs)) + static_cast<double>(kSpareCapacity);
  const auto room = [&](std::size_t& capacity, std::size_t asked, double per_pair) {
    if (asked == 0) capacity = std::max(capacity, static_cast<std::size_t>(per_pair * in_batch));
  };
  room(buffers_.proposal_capacity, asked_.proposals, kProposalsPerPair);
  room(buffers_.table_size, asked_.table, kTablePerPair);
  buffers_.table_size = std::bit_ceil(buffers_.table_size);
  room(buffers_.flagged_capacity, asked_.flagged, kFlaggedPerPair);
  reserve_flagged();
  buffers_.proposals.reserve(buffers_.proposal_capacity * sizeof(PairName));
  buffers_.table.reserve(buffers_.table_size * kWord);
  buffers_.no_labels.reserve(kWord);
  buffers_.cell_errors.reserve(error_bytes(job));
}

// Memory for as many flagged pairs as there is to be room for, and for those of them that are gathered for the CPU.
void PairPass::reserve_flagged() {
  buffers_.flagged.reserve(kFlaggedLists * buffers_.flagged_capacity * kWord);
  gathered_.reserve(most_gathered() * sizeof(GatheredPair));
}

std::size_t PairPass::most_gathered() const { return std::min(buffers_.flagged_capacity, kGatheredAtOnce); }

void PairPass::run(const PairJob& job, Certification& certification) {
  for (;;) {
    reserve(job);
    certification = {};
    job.store.ranges.clear();
    job.store.count = 0;
    // Not the targets of wider lists, which the evaluation has found before.
    clear_work(job, kProposals, kWorkTargets);
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

void PairPass::learn_speed(std::size_t pairs, double seconds) {
  if (asked_.at_once || device_.description().kind == "software" || !(seconds > 0)) return;
  const double at_once = static_cast<double>(pairs) * kSecondsAtOnce / seconds;
  at_once_ = static_cast<std::size_t>(std::clamp(at_once, 65536.0, 1e9));
}

// Makes room for what was too small; all has to be done again.
void PairPass::grow(const PairJob& job, const Counters& counters) {
  const uint overflow = counters[kOverflow];
  job.commands.fill(job.counters, kOverflow * kWord, kWord, 0);
  if (overflow & kOverflowProposals) buffers_.proposal_capacity *= 2;
  if (overflow & kOverflowTable) buffers_.table_size *= 2;
  if (overflow & kOverflowFlagged) buffers_.flagged_capacity *= 2;
  if (overflow & kOverflowWide) {
    // First lists once more, in place of wider ones that are empty.
    job.neighbours.wanted(counters[kWideEntries]);
    clear_work(job, kWideTargets, 1);
    job.commands.fill(job.counters, kWideEntries * kWord, kWord, 0);
    job.neighbours.begin(job.commands, job.seeds);
    job.neighbours.list_nearest(job.commands, job.seeds, job.counters);
  }
  if (!(overflow & kOverflowPairs)) return;
  const std::size_t most = most_pairs();
  if (job.store.capacity >= most)
    throw DeviceError(
        fmt::format("{}: more than {} pairs of cells and {}, which its buffers do not hold; use fewer vertices",
                    device_.description().name, most, job.domain.elements()));
  job.store.capacity = std::min(job.store.capacity * 2, most);
}

// False if some buffer was too small: then it is larger now, and all has to be done again.
bool PairPass::run_batch(const PairJob& job, std::size_t batch, Certification& certification) {
  const std::size_t chunk = job.domain.chunk_of(batch);
  start(job, batch);
  for (int rounds = rounds_;;) {
    spread(job, chunk, rounds);
    for (int k = 0; k < kClimbs; ++k) {
      climb(job, chunk);
      spread(job, chunk, kRoundsAfterClimb);
    }
    const Counters counters = gather_and_count(job);
    if (counters[kOverflow]) {
      grow(job, counters);
      return false;
    }
    job.store.count = counters[kPairs];
    if (!for_cpu_.empty()) answer(job, counters);
    else if (!are_left(counters, kProposals) && !are_left(counters, kPairs) && !are_left(counters, kShortLists) &&
             !are_left(counters, kUnsure)) {
      certification.wider += counters[kShortLists] - counters[kShortAgain];
      certification.uncertain = counters[kUnsurePairs];
      count_lists(counters, certification);
      job.neighbours.wanted(counters[kWideEntries]);
      rounds_ =
          std::clamp(static_cast<int>(counters[kRounds]) - kClimbs * kRoundsAfterClimb + 1, kLeastRounds, kMostRounds);
      return true;
    }
    rounds = are_left(counters, kProposals) || are_left(counters, kPairs) ? kMostRounds : 1;
  }
}

// What climbed to the rungs of double precision and of the CPU since the lists were cleared.
void PairPass::count_lists(const Counters& counters, Certification& certification) {
  certification.doubled += counters[kUnsure];
  certification.cpu += counters[kForCpu];
  certification.doubled -= counters[kUnsureInDouble] - unsure_in_double_;
  unsure_in_double_ = counters[kUnsureInDouble];
}

std::size_t PairPass::refine(const PairJob& job, const Buffer& cells, float share, Certification& certification) {
  std::size_t refined = 0;
  for (const PairStore::Range& range : job.store.ranges) refined += refine(job, range, cells, share, certification);
  job.commands.fill(job.counters, kOverflow * kWord, kWord, 0);
  return refined;
}

std::size_t PairPass::refine(const PairJob& job, const PairStore::Range& range, const Buffer& cells, float share,
                             Certification& certification) {
  const uint listed = job.domain.double_next() ? kUnsure : kForCpu;
  const auto list_doubtful = [&] {
    const DoubtfulPush push{word(range.begin), word(range.end - range.begin), word(buffers_.flagged_capacity),
                            static_cast<float>(job.domain.mean_density()), share};
    job.commands.phase(&DeviceSeconds::clip);
    clear_lists(job);
    job.commands.dispatch({"doubtful", {job.domain.double_next(), job.domain.is_solid()}},
                          {reads(job.store.pairs), reads(job.store.status), reads(buffers_.cell_errors), reads(cells),
                           updates(job.counters), updates(buffers_.flagged), reads(job.seeds.ids)},
                          push, push.pair_count);
  };
  list_doubtful();
  for (bool first = true;; first = false) {
    // What these pairs propose has been met before.
    clear_work(job, kProposals, 1);
    job.commands.fill(job.counters, kOverflow * kWord, kWord, 0);
    if (!first) climb(job, range.chunk);
    else climb_in_double(job, range.chunk);
    const Counters counters = gather_and_count(job);
    if (counters[listed] > buffers_.flagged_capacity) {
      buffers_.flagged_capacity = counters[listed] + counters[listed] / 4;
      reserve_flagged();
      list_doubtful();
    } else if (!for_cpu_.empty()) {
      answer(job, counters);
    } else if (!are_left(counters, kShortLists) && !are_left(counters, kUnsure)) {
      // Pairs that had too short a list in double precision are listed twice.
      const std::size_t found = listed == kUnsure ? counters[kUnsure] - counters[kShortLists] : counters[kForCpu];
      certification.uncertain += found;
      count_lists(counters, certification);
      return found;
    }
  }
}

void PairPass::clear_lists(const PairJob& job) { clear_work(job, kShortLists, 3); }

void PairPass::start(const PairJob& job, std::size_t batch) {
  job.commands.phase(&DeviceSeconds::clip);
  job.commands.fill(buffers_.table, 0, buffers_.table_size * kWord, 0);
  job.commands.fill(job.counters, kRounds * kWord, 2 * kWord, 0);  // and kShortAgain
  clear_work(job, kProposals, 1);
  clear_lists(job);
  job.domain.start(job, buffers_, batch);
  // What is a pair by now is not clipped.
  advance(job, kWorkPairs, job.store.capacity, kNone);
}

void PairPass::advance(const PairJob& job, uint kind, std::size_t capacity, std::size_t most) {
  const AdvancePush push{kind, word(capacity), device_.limits().groups, word(std::min<std::size_t>(most, kNone)),
                         kind == kWorkTargets ? 1 : kGroupSize};
  job.commands.dispatch({"advance", {}}, {updates(job.counters)}, push, 1);
}

// Records rounds in which proposals become pairs, and pairs are clipped and propose more.
void PairPass::spread(const PairJob& job, std::size_t chunk, int rounds) {
  const AdmitPush admit{word(buffers_.table_size - 1), word(job.store.capacity)};
  for (int round = 0; round < rounds; ++round) {
    advance(job, kWorkProposals, buffers_.proposal_capacity, at_once_);
    job.commands.dispatch_indirect(
        {"admit", {}},
        {reads(buffers_.proposals), updates(buffers_.table), updates(job.store.pairs), updates(job.counters)}, admit,
        job.counters, (kGroups + 3 * kWorkProposals) * kWord);
    advance(job, kWorkPairs, job.store.capacity, at_once_);
    clip(job, chunk, {}, {}, buffers_.no_labels,
         [&](const Kernel& k, std::initializer_list<Binding> bindings, const ClipPush& p) {
           job.commands.dispatch_indirect(k, bindings, p, job.counters, (kGroups + 3 * kWorkPairs) * kWord);
         });
  }
}

// Records the next rungs of the device for what is listed. Pairs that double precision finds their lists too short for
// are taken there again, with a wider one, when this is recorded next.
void PairPass::climb(const PairJob& job, std::size_t chunk) {
  advance(job, kWorkShort, buffers_.flagged_capacity, at_once_);
  job.neighbours.choose_targets(job.commands, buffers_.flagged, kFlaggedShort * buffers_.flagged_capacity,
                                job.store.pairs, job.counters);
  advance(job, kWorkTargets, job.neighbours.target_capacity(), at_once_);
  job.neighbours.widen(job.commands, job.seeds, job.counters);
  clip_listed(job, chunk, kRungWide, kFlaggedShort);
  climb_in_double(job, chunk);
}

void PairPass::climb_in_double(const PairJob& job, std::size_t chunk) {
  if (!job.domain.double_next()) return;
  advance(job, kWorkUnsure, buffers_.flagged_capacity, at_once_);
  clip_listed(job, chunk, kRungDouble, kFlaggedUncertain);
}

void PairPass::clip(const PairJob& job, std::size_t chunk, const ClipKind& kind, ClipPush push, const Buffer& labels,
                    const ClipDispatch& dispatch) {
  push.residual = job.seeds.residual;
  push.two = kTwo;
  push.proposal_capacity = word(buffers_.proposal_capacity);
  push.flagged_capacity = word(buffers_.flagged_capacity);
  push.cell_count = word(job.seeds.count());
  job.commands.phase(&DeviceSeconds::clip);
  job.domain.clip(job, buffers_, chunk, kind, push, labels, dispatch);
}

void PairPass::clip_listed(const PairJob& job, std::size_t chunk, uint rung, uint list) {
  ClipPush push{};
  push.first_pair = word(list * buffers_.flagged_capacity);
  clip(job, chunk, {rung, true, false}, push, buffers_.no_labels,
       [&](const Kernel& k, std::initializer_list<Binding> bindings, const ClipPush& p) {
         job.commands.dispatch_indirect(k, bindings, p, job.counters, (kGroups + 3 * (kWorkShort + list)) * kWord);
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

// Runs what is recorded, and names the pairs that the CPU is asked about. Some are downloaded with the counters, so
// that a few take no further wait.
Counters PairPass::gather_and_count(const PairJob& job) {
  Commands& commands = job.commands;
  const std::size_t most = most_gathered();
  advance(job, kWorkForCpu, buffers_.flagged_capacity, most);
  commands.dispatch_indirect({"gather_pairs", {}},
                             {reads(buffers_.flagged), reads(job.store.pairs), writes(gathered_), reads(job.counters)},
                             GatherPairsPush{word(kFlaggedForCpu * buffers_.flagged_capacity)}, job.counters,
                             (kGroups + 3 * kWorkForCpu) * kWord);
  Counters counters{};
  for_cpu_.resize(std::min(expect_for_cpu_, most));
  commands.download(job.counters, 0, counters.data(), sizeof counters);
  commands.download(gathered_, 0, for_cpu_.data(), for_cpu_.size() * sizeof(GatheredPair));
  commands.run();
  const std::size_t had = for_cpu_.size(), count = counters[kForCpu + kEndAfter] - counters[kForCpu + kBeginAfter];
  for_cpu_.resize(count);
  if (count > had) {
    commands.download(gathered_, had * sizeof(GatheredPair), for_cpu_.data() + had,
                      (count - had) * sizeof(GatheredPair));
    commands.run();
  }
  return counters;
}

// Settles what was gathered in exact arithmetic, and records the answers.
void PairPass::answer(const PairJob& job, const Counters& counters) {
  const std::size_t count = for_cpu_.size();
  expect_for_cpu_ = count + count / 4 + kLeastExpected;
  Commands& commands = job.commands;
  std::vector<PairName> names;
  for (const GatheredPair& pair : for_cpu_) names.push_back(pair.name);
  const std::vector<ExactPair> pairs = job.domain.clip_exactly(job, names);

  std::vector<PairAnswer> answers;
  std::vector<PairName> proposals;
  RealWords values(double_);
  for (std::size_t k = 0; k < count; ++k) {
    answers.push_back({for_cpu_[k].pair, pairs[k].empty ? kStatusEmpty : kStatusClipped});
    values.moments(pairs[k].moments);
    proposals.insert(proposals.end(), pairs[k].proposals.begin(), pairs[k].proposals.end());
  }
  upload(commands, answers_, answers);
  upload(commands, values_, values);
  commands.dispatch(kernel("store_answers", double_),
                    {reads(answers_), reads(values_), updates(job.store.status), updates(job.store.mass_second),
                     updates(job.store.first)},
                    CountPush{word(count)}, count);
  const std::size_t before = counters[kProposals], added = proposals.size();
  if (before + added > buffers_.proposal_capacity) {
    commands.fill(job.counters, kOverflow * kWord, kWord, kOverflowProposals);
  } else if (added) {
    commands.upload(buffers_.proposals, before * sizeof(PairName), proposals.data(), added * sizeof(PairName));
    commands.fill(job.counters, kProposals * kWord, kWord, word(before + added));
  }
}

}  // namespace bisector::host
