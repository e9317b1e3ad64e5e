// Places in the buffer of counters: twins of kernels/counters.glsl.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace bisector::host {

enum Counter : std::size_t {
  kProposals,
  kProposalsBegin,
  kProposalsEnd,
  kPairs,
  kPairsBegin,
  kPairsEnd,
  kOverflow,
  kShort,
  kUncertain,
  kForCpu,
  kTargetCount,
  kMet,
  kLostSites,
  kTwice,
  kUnsureMet,
  kUnsettled,
  kProposalGroups = 16,
  kPairGroups = 20,
  kCounters = 24,
};
inline constexpr std::uint32_t kOverflowProposals = 1, kOverflowPairs = 2, kOverflowTable = 4;

using Counters = std::array<std::uint32_t, kCounters>;

}  // namespace bisector::host
