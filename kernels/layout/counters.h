// Places in the buffer of counters, which the host reads after each run.
#ifndef BISECTOR_KERNELS_LAYOUT_COUNTERS_H
#define BISECTOR_KERNELS_LAYOUT_COUNTERS_H

#include "types.h"

LAYOUT_BEGIN

// Kinds of work that kernels leave for later dispatches. Of each kind there are three counters: how many items there
// are, and the range of them that is worked on; and the number of workgroups for that, three words.
LAYOUT_CONSTANT uint kWorkProposals = 0;
LAYOUT_CONSTANT uint kWorkPairs = 1;
LAYOUT_CONSTANT uint kWorkShort = 2;    // pairs whose list was too short, or that have too many corners
LAYOUT_CONSTANT uint kWorkUnsure = 3;   // pairs with an uncertain decision that double precision may make
LAYOUT_CONSTANT uint kWorkForCpu = 4;   // pairs that only exact arithmetic decides
LAYOUT_CONSTANT uint kWorkTargets = 5;  // cells that need a wider list
LAYOUT_CONSTANT uint kWorkKinds = 6;
LAYOUT_CONSTANT uint kWorkWords = 3;
LAYOUT_CONSTANT uint kBeginAfter = 1;  // after the count
LAYOUT_CONSTANT uint kEndAfter = 2;

LAYOUT_CONSTANT uint kProposals = 0;
LAYOUT_CONSTANT uint kPairs = 3;
LAYOUT_CONSTANT uint kShortLists = 6;
LAYOUT_CONSTANT uint kUnsure = 9;
LAYOUT_CONSTANT uint kForCpu = 12;
LAYOUT_CONSTANT uint kWideTargets = 15;
LAYOUT_CONSTANT uint kGroups = 18;  // of the first kind

LAYOUT_CONSTANT uint kOverflow = 36;    // bits kOverflow...: which buffers were too small
LAYOUT_CONSTANT uint kRounds = 37;      // of proposals that came to anything
LAYOUT_CONSTANT uint kShortAgain = 38;  // pairs that are listed once more as their wider list was too short too
// Of one evaluation.
LAYOUT_CONSTANT uint kCoincident = 39;       // seeds that this precision cannot tell apart from another
LAYOUT_CONSTANT uint kUncertainOwners = 40;  // points without a certain owner
LAYOUT_CONSTANT uint kDuplicatePairs = 41;   // must stay 0
LAYOUT_CONSTANT uint kUnsurePairs = 42;      // pairs with an uncertain decision
LAYOUT_CONSTANT uint kUnsureInDouble = 43;   // and those of them that double precision left uncertain
LAYOUT_CONSTANT uint kItems = 44;            // pairs that are not empty
LAYOUT_CONSTANT uint kLargeCells = 45;       // with more items than rank.comp goes through
LAYOUT_CONSTANT uint kWideEntries = 46;      // of wider lists, whether or not there is memory for them

LAYOUT_CONSTANT uint kCounters = 48;  // words of the buffer

LAYOUT_CONSTANT uint kOverflowProposals = 1;
LAYOUT_CONSTANT uint kOverflowPairs = 2;
LAYOUT_CONSTANT uint kOverflowTable = 4;
LAYOUT_CONSTANT uint kOverflowFlagged = 8;
LAYOUT_CONSTANT uint kOverflowWide = 16;

LAYOUT_END

#ifdef __cplusplus
namespace bisector::host {
static_assert(kPairs == kWorkWords * kWorkPairs && kShortLists == kWorkWords * kWorkShort &&
              kUnsure == kWorkWords * kWorkUnsure && kForCpu == kWorkWords * kWorkForCpu &&
              kWideTargets == kWorkWords * kWorkTargets && kGroups == kWorkWords * kWorkKinds &&
              kOverflow == kGroups + 3 * kWorkKinds);
using Counters = std::array<std::uint32_t, kCounters>;
}  // namespace bisector::host
#endif
#endif
