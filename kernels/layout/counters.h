// Places in the buffer of counters, which the host reads after each run.
#ifndef BISECTOR_KERNELS_LAYOUT_COUNTERS_H
#define BISECTOR_KERNELS_LAYOUT_COUNTERS_H

#include "types.h"

LAYOUT_BEGIN

// Of one batch: how many there are, and the range that is being worked on.
LAYOUT_CONSTANT uint kProposals = 0;
LAYOUT_CONSTANT uint kProposalsBegin = 1;
LAYOUT_CONSTANT uint kProposalsEnd = 2;
LAYOUT_CONSTANT uint kPairs = 3;
LAYOUT_CONSTANT uint kPairsBegin = 4;
LAYOUT_CONSTANT uint kPairsEnd = 5;
LAYOUT_CONSTANT uint kOverflow = 6;  // bits kOverflow...: which buffers were too small
// Pairs in the three lists of flagged pairs.
LAYOUT_CONSTANT uint kShortLists = 7;  // their list was too short, or they have too many corners
LAYOUT_CONSTANT uint kUncertain = 8;   // a decision is uncertain that double precision may make
LAYOUT_CONSTANT uint kForCpu = 9;      // only exact arithmetic decides
// Of one evaluation.
LAYOUT_CONSTANT uint kWideTargets = 10;      // cells that need a wider list
LAYOUT_CONSTANT uint kCoincident = 11;       // seeds that this precision cannot tell apart from another
LAYOUT_CONSTANT uint kUncertainOwners = 12;  // points without a certain owner
LAYOUT_CONSTANT uint kDuplicatePairs = 13;   // must stay 0
LAYOUT_CONSTANT uint kUnsurePairs = 14;      // pairs with an uncertain decision
LAYOUT_CONSTANT uint kUnsureInDouble = 15;   // and those of them that double precision left uncertain
// Numbers of workgroups, for indirect dispatches: three words each.
LAYOUT_CONSTANT uint kProposalGroups = 16;
LAYOUT_CONSTANT uint kPairGroups = 20;

LAYOUT_CONSTANT uint kCounters = 24;  // words of the buffer

LAYOUT_CONSTANT uint kOverflowProposals = 1;
LAYOUT_CONSTANT uint kOverflowPairs = 2;
LAYOUT_CONSTANT uint kOverflowTable = 4;

LAYOUT_END

#ifdef __cplusplus
namespace bisector::host {
using Counters = std::array<std::uint32_t, kCounters>;
}
#endif
#endif
