// Pairs of an element (a facet or a tetrahedron) and a cell: what is known of them, and how they lie in buffers.
#ifndef BISECTOR_KERNELS_LAYOUT_PAIRS_H
#define BISECTOR_KERNELS_LAYOUT_PAIRS_H

#include "types.h"

// No index. C++ has it as bisector::kNone, GLSL as kNone of common.glsl.
#define LAYOUT_NONE 0xffffffffu
// A label with this bit is no slot but a part of the element's own border: its edge or facet k in the bits below.
#define LAYOUT_BORDER_LABEL 0x80000000u

LAYOUT_BEGIN

// Status.
LAYOUT_CONSTANT uint kStatusClipped = 1;    // moments and labels are final
LAYOUT_CONSTANT uint kStatusEmpty = 2;      // element and cell do not meet
LAYOUT_CONSTANT uint kStatusShortList = 3;  // the list ended before the cell was closed
LAYOUT_CONSTANT uint kStatusCrowded = 4;    // more corners, planes or vertices than there is memory for
LAYOUT_CONSTANT uint kStatusUnsure = 5;     // a decision lies within its error bound
LAYOUT_CONSTANT uint kStatusWhole = 6;      // the cell holds all of the element

// Rungs of certification on the device. What the last leaves uncertain goes to exact arithmetic on the CPU.
LAYOUT_CONSTANT uint kRungFirst = 0;   // the lists of neighbours found first
LAYOUT_CONSTANT uint kRungWide = 1;    // wider lists
LAYOUT_CONSTANT uint kRungDouble = 2;  // double precision after single

// Flagged pairs lie in three lists of equal capacity in one buffer. Their kinds of work (counters.h) are in the same
// order.
LAYOUT_CONSTANT uint kFlaggedShort = 0;      // for kRungWide
LAYOUT_CONSTANT uint kFlaggedUncertain = 1;  // for kRungDouble
LAYOUT_CONSTANT uint kFlaggedForCpu = 2;
LAYOUT_CONSTANT uint kFlaggedLists = 3;
// Of a pair in the first list or, after that, in the second: double precision found its list too short, and clips it
// again once its cell has a wider one.
LAYOUT_CONSTANT uint kAgainInDouble = 0x80000000u;

// Moments in words of one real: mass, first moment, second moment.
LAYOUT_CONSTANT uint kMomentWords = 5;
LAYOUT_CONSTANT uint kFirstMomentAt = 1;
LAYOUT_CONSTANT uint kSecondMomentAt = 4;
// Those of pairs lie in two buffers: mass and second moment, first moment.
LAYOUT_CONSTANT uint kMassSecondWords = 2;
LAYOUT_CONSTANT uint kFirstWords = 3;
// What leaves the device of each cell: moments, then the mass that scales its seed's step, or -1 if it is not known.
LAYOUT_CONSTANT uint kCellWords = 6;
LAYOUT_CONSTANT uint kCellStepMassAt = 5;

// Of each cell, in single precision: the bits of the largest error of mass that its pairs may have, then of energy.
// Behind those of all cells lies one word of marks for each.
LAYOUT_CONSTANT uint kCellErrorWords = 2;
LAYOUT_CONSTANT uint kEnergyErrorAt = 1;
LAYOUT_CONSTANT uint kMarkWords = 1;
LAYOUT_CONSTANT uint kMarkBoundary = 1;  // the cell meets the solid's boundary
LAYOUT_CONSTANT uint kMarkMet = 2;       // some cell inside has it for a neighbour

// Labels of a polygon: their number (or none where it is uncertain), then the labels.
LAYOUT_CONSTANT uint kPolygonHeader = 1;
// Labels of a polyhedron: the numbers of planes (or none where it is uncertain) and of vertices, then the planes'
// labels in order of their keys, then for each vertex the places of its three planes among them, a byte each.
LAYOUT_CONSTANT uint kPolyhedronHeader = 2;

// Pairs that the CPU is asked about: pair, element, slot.
LAYOUT_CONSTANT uint kGatheredWords = 3;
// And its answers: pair, status.
LAYOUT_CONSTANT uint kAnswerWords = 2;

// How wide a list of neighbours is; all but first ones lie in a buffer of their own. A cell gets wider ones as it needs
// them.
LAYOUT_CONSTANT uint kListFirst = 0;
LAYOUT_CONSTANT uint kListWide = 1;
LAYOUT_CONSTANT uint kListWidest = 2;  // kWidestList entries, or there was no memory for them

LAYOUT_END

#ifdef __cplusplus
namespace bisector::host {

struct PairName {
  uint element, slot;
};
struct GatheredPair {
  uint pair;
  PairName name;
};
struct PairAnswer {
  uint pair, status;
};
struct PointOwner {
  uint point, slot;
};
// What cell_pass.cpp sorts by slot.
struct SortItem {
  uint slot, pair;
};
// Of a slot; the radius is a float's bits, squared, in lengths of the device; the width is one of kList... above.
struct ListInfo {
  uint first, count, squared_radius, width;
};
// Of a slot: the caller's index, and the low words of the coordinates as doubles.
struct SeedId {
  uint index;
  std::array<uint, 3> low;
};

static_assert(sizeof(PairName) == 8);  // uvec2
static_assert(sizeof(GatheredPair) == kGatheredWords * sizeof(uint));
static_assert(offsetof(GatheredPair, name) == 1 * sizeof(uint));
static_assert(sizeof(PairAnswer) == kAnswerWords * sizeof(uint));
static_assert(sizeof(PointOwner) == 8);  // uvec2
static_assert(sizeof(SortItem) == 8);    // uvec2
static_assert(sizeof(ListInfo) == 16);   // uvec4
static_assert(offsetof(ListInfo, squared_radius) == 2 * sizeof(uint));
static_assert(sizeof(SeedId) == 16);  // uvec4

}  // namespace bisector::host
#endif
#endif
