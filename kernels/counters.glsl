// Places in the buffer of counters, which the host reads after each run: host/layout.h names them alike.
const uint kProposals = 0;
const uint kProposalsBegin = 1;
const uint kProposalsEnd = 2;
const uint kPairs = 3;
const uint kPairsBegin = 4;
const uint kPairsEnd = 5;
const uint kOverflow = 6;         // bits: proposals, pairs, table
const uint kShort = 7;            // pairs whose list was too short or whose polygon has too many corners
const uint kUncertain = 8;        // pairs with an uncertain decision that double precision may settle
const uint kForCpu = 9;           // pairs that only exact arithmetic settles
const uint kTargetCount = 10;     // cells that need a wider list
const uint kMet = 11;             // seeds that this precision cannot tell apart
const uint kLostSites = 12;       // sites without a certain owner
const uint kTwice = 13;           // pairs met twice: must stay 0
const uint kUnsureMet = 14;       // pairs with an uncertain decision, over the whole evaluation
const uint kUnsettled = 15;       // and those of them that double precision did not settle
const uint kProposalGroups = 16;  // indirect arguments
const uint kPairGroups = 20;

const uint kOverflowProposals = 1;
const uint kOverflowPairs = 2;
const uint kOverflowTable = 4;

const uint kWideList = 0x80000000u;  // in the first entry of a list: it lies among the wide ones
