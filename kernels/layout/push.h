// The push constants of all kernels. A kernel has one block of them and chooses it by defining the block's PUSH_...
// before it includes this header.
#ifndef BISECTOR_KERNELS_LAYOUT_PUSH_H
#define BISECTOR_KERNELS_LAYOUT_PUSH_H

#include "sizes.h"
#include "types.h"

LAYOUT_BEGIN

#if LAYOUT_CPLUSPLUS || defined(PUSH_COUNT)
PUSH_CONSTANTS(CountPush) {
  uint count;  // of the items that the kernel goes through
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_CELLS)
PUSH_CONSTANTS(CellsPush) { uint cell_count; };
#endif

// The tree of boxes over the seeds, by which all kernels that look for seeds find them (seed_tree.glsl).
#define TREE_PUSH_CONSTANTS                                                                            \
  uint seed_count;                                                                                     \
  uint top_level;                /* the level of one box around all seeds */                           \
  float residual;                /* what a difference of two positions may lack in single precision */ \
  uint two;                      /* 2: see loops_complete() of common.glsl */                          \
  uint level_begin[kTreeLevels]; /* the first node of each level, the leaves' being level 0 */

#if LAYOUT_CPLUSPLUS || defined(PUSH_BOXES)
PUSH_CONSTANTS(BoxesPush) {
  uint first_child;  // seed or node
  uint child_count;
  uint first_node;  // of the level
  float vague;      // by how much a coordinate may be off, in a box or rounded to single precision
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_NEIGHBOURS)
PUSH_CONSTANTS(NeighboursPush){TREE_PUSH_CONSTANTS};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_OWNERS)
PUSH_CONSTANTS(OwnersPush) {
  TREE_PUSH_CONSTANTS
  uint point_count;
  uint report_uncertain;  // whether points without a certain owner are listed
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_WIDE_TARGETS)
PUSH_CONSTANTS(WideTargetsPush) {
  uint first_flagged;  // entry of the buffer of flagged pairs
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_WIDE_LISTS)
PUSH_CONSTANTS(WideListsPush) {
  TREE_PUSH_CONSTANTS
  uint wide_capacity;  // entries that there is memory for
  uint may_grow;       // whether there may be memory for more
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_START_FACETS)
PUSH_CONSTANTS(StartFacetsPush) {
  uint element_base;  // the first facet of the buffers
  uint first_facet;   // of the batch
  uint facet_count;
  uint proposal_capacity;
  uint pair_capacity;
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_START_SAMPLES)
PUSH_CONSTANTS(StartSamplesPush) {
  uint element_base;  // the first facet of the buffers
  uint first_sample;  // of the batch
  uint sample_count;
  uint proposal_capacity;
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_START_TETS)
PUSH_CONSTANTS(StartTetsPush) {
  uint first_tet;  // of the batch
  uint tet_count;
  uint proposal_capacity;
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_ADVANCE)
PUSH_CONSTANTS(AdvancePush) {
  uint kind;         // of work: kWork... of counters.h
  uint capacity;     // of its buffer
  uint most_groups;  // in one dimension of a dispatch
  uint most_items;   // of one dispatch
  uint group_items;  // of a workgroup
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_ADMIT)
PUSH_CONSTANTS(AdmitPush) {
  uint table_mask;  // the size of the table, a power of two, less 1
  uint pair_capacity;
};
#endif

// Of clip.comp and clip_tet.comp.
#if LAYOUT_CPLUSPLUS || defined(PUSH_CLIP)
PUSH_CONSTANTS(ClipPush) {
  uint element_base;  // the first facet of the buffers
  float residual;     // what a difference of two positions may lack in single precision; 0 in double
  uint two;           // 2: see loops_complete() of common.glsl
  uint first_pair;    // whose labels are wanted; or else the first entry of the list of flagged pairs
  uint pair_count;    // whose labels are wanted
  uint proposal_capacity;
  uint flagged_capacity;  // of one list of flagged pairs
  uint cell_count;
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_DOUBTFUL)
PUSH_CONSTANTS(DoubtfulPush) {
  uint first_pair;
  uint pair_count;
  uint flagged_capacity;  // of one list of flagged pairs
  float mean_density;
  float share;  // of the errors that are allowed
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_GATHER_PAIRS)
PUSH_CONSTANTS(GatherPairsPush) {
  uint first_flagged;  // entry of the buffer of flagged pairs
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_RADIX)
PUSH_CONSTANTS(RadixPush) {
  uint item_count;
  uint run_count;
  uint shift;  // of the digit within the key
};
#endif

// Of descents.
#if LAYOUT_CPLUSPLUS || defined(PUSH_MOVE)
PUSH_CONSTANTS(MovePush) {
  double step_length;
  double farthest;  // coordinate that is within reach
  uint count;       // of seeds
  uint two;         // 2: see loops_complete() of common.glsl
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_MEASURE)
PUSH_CONSTANTS(MeasurePush) {
  double mean_mass;
  uint count;        // of seeds
  uint block_count;  // of sums
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_DIRECT)
PUSH_CONSTANTS(DirectPush) {
  uint count;        // of seeds
  uint coefficient;  // the number that is meant
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_SUMS)
PUSH_CONSTANTS(SumsPush) {
  uint count;  // of terms of one kind
  uint kinds;
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_FINISH)
PUSH_CONSTANTS(FinishPush) {
  double multiplier;
  uint count;  // of terms of one kind
  uint kinds;
  uint place;  // of the first number that is set
  uint onto;   // whether what the number was is part of it
};
#endif

LAYOUT_END

#ifdef __cplusplus
namespace bisector::host {

// In GLSL blocks are laid out by std430: scalars of four bytes follow each other, and a vec3 starts at a multiple of 16
// bytes and takes 12.
static_assert(sizeof(float) == sizeof(uint) && sizeof(vec3) == 3 * sizeof(float) && alignof(vec3) == alignof(float));
static_assert(sizeof(CountPush) == 4 && sizeof(CellsPush) == 4);
static_assert(sizeof(BoxesPush) == 16 && offsetof(BoxesPush, vague) == 12);
static_assert(sizeof(NeighboursPush) == 16 + 4 * kTreeLevels && offsetof(NeighboursPush, residual) == 8 &&
              offsetof(NeighboursPush, level_begin) == 16);
static_assert(sizeof(OwnersPush) == 24 + 4 * kTreeLevels && offsetof(OwnersPush, level_begin) == 16 &&
              offsetof(OwnersPush, report_uncertain) == 20 + 4 * kTreeLevels);
static_assert(sizeof(WideTargetsPush) == 4);
static_assert(sizeof(WideListsPush) == 24 + 4 * kTreeLevels &&
              offsetof(WideListsPush, may_grow) == 20 + 4 * kTreeLevels);
static_assert(sizeof(StartFacetsPush) == 20 && offsetof(StartFacetsPush, pair_capacity) == 16);
static_assert(sizeof(StartSamplesPush) == 16 && offsetof(StartSamplesPush, proposal_capacity) == 12);
static_assert(sizeof(StartTetsPush) == 12 && offsetof(StartTetsPush, proposal_capacity) == 8);
static_assert(sizeof(AdvancePush) == 20 && offsetof(AdvancePush, group_items) == 16);
static_assert(sizeof(AdmitPush) == 8 && offsetof(AdmitPush, pair_capacity) == 4);
static_assert(sizeof(ClipPush) == 32 && offsetof(ClipPush, residual) == 4 && offsetof(ClipPush, cell_count) == 28);
static_assert(sizeof(DoubtfulPush) == 20 && offsetof(DoubtfulPush, mean_density) == 12 &&
              offsetof(DoubtfulPush, share) == 16);
static_assert(sizeof(GatherPairsPush) == 4);
static_assert(sizeof(MovePush) == 24 && offsetof(MovePush, count) == 16 && offsetof(MovePush, two) == 20);
static_assert(sizeof(MeasurePush) == 16 && offsetof(MeasurePush, count) == 8);
static_assert(sizeof(DirectPush) == 8 && sizeof(SumsPush) == 8);
static_assert(sizeof(FinishPush) == 24 && offsetof(FinishPush, count) == 8 && offsetof(FinishPush, onto) == 20);
static_assert(sizeof(RadixPush) == 12 && offsetof(RadixPush, shift) == 8);

}  // namespace bisector::host
#endif
#endif
