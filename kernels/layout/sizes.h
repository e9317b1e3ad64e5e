// How work is cut up: workgroups, blocks of sums, runs of sorting.
#ifndef BISECTOR_KERNELS_LAYOUT_SIZES_H
#define BISECTOR_KERNELS_LAYOUT_SIZES_H

#include "types.h"

LAYOUT_BEGIN

LAYOUT_CONSTANT uint kGroupSize = 64;  // invocations of a workgroup, of every kernel

// The specialisation constant of all kernels that says in which order they take their items (common.glsl).
LAYOUT_CONSTANT uint kOrderConstant = 100;

LAYOUT_CONSTANT uint kScanLane = 16;     // values that one invocation of scan_blocks.comp sums
LAYOUT_CONSTANT uint kScanBlock = 1024;  // and one workgroup: kGroupSize * kScanLane

// Seeds of a leaf of the tree of boxes, children of its other nodes, and levels that it may have, one more than any
// number of seeds of 32 bits needs.
LAYOUT_CONSTANT uint kTreeArity = 8;
LAYOUT_CONSTANT uint kTreeLevels = 12;
LAYOUT_CONSTANT uint kBoxWords = 6;  // of a node: floats, the lower corner, then the upper one

// Entries of the widest lists of neighbours, which take nearly all the shared memory that a workgroup has on every
// device. A power of two.
LAYOUT_CONSTANT uint kWidestList = 1024;

// Terms that sum.comp adds in a row, by the CPU's rule of sums (voronoi/fixed_tree_sum.h).
LAYOUT_CONSTANT uint kSumBlock = 32;

// Items of a cell that rank_items.comp sorts and sum_cells.comp adds.
LAYOUT_CONSTANT uint kMostRanked = 4096;

LAYOUT_CONSTANT uint kRadixRun = 64;     // consecutive items that one invocation sorts
LAYOUT_CONSTANT uint kRadixBits = 4;     // of the key, in one pass
LAYOUT_CONSTANT uint kRadixDigits = 16;  // 2^kRadixBits

LAYOUT_END

#ifdef __cplusplus
static_assert(bisector::host::kScanBlock == bisector::host::kGroupSize * bisector::host::kScanLane);
static_assert(bisector::host::kRadixDigits == 1u << bisector::host::kRadixBits);
#endif
#endif
