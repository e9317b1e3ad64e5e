// The push constants of all kernels. A kernel has one block of them and chooses it by defining the block's PUSH_...
// before it includes this header.
#ifndef BISECTOR_KERNELS_LAYOUT_PUSH_H
#define BISECTOR_KERNELS_LAYOUT_PUSH_H

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

// A grid of the seeds, by which all kernels that look for seeds find them (grid.glsl).
#define GRID_PUSH_CONSTANTS                               \
  vec3 grid_lower;    /* corner of the grid */            \
  float grid_inverse; /* 1 / the edge of a grid cell */   \
  uint bucket_mask;   /* the number of buckets, less 1 */ \
  uint seed_count;

#if LAYOUT_CPLUSPLUS || defined(PUSH_GRID)
PUSH_CONSTANTS(GridPush){GRID_PUSH_CONSTANTS};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_NEIGHBOURS)
PUSH_CONSTANTS(NeighboursPush) {
  GRID_PUSH_CONSTANTS
  float residual;        // what a difference of two positions may lack in single precision; 0 in double
  uint two;              // 2: see loops_complete() of common.glsl
  uint first_target;     // of the cells that need a wider list, the first that has none yet
  uint target_capacity;  // wide lists that there is memory for
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_OWNERS)
PUSH_CONSTANTS(OwnersPush) {
  GRID_PUSH_CONSTANTS
  float residual;
  uint two;
  uint point_count;
  uint report_uncertain;  // whether points without a certain owner are listed
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_WIDE_TARGETS)
PUSH_CONSTANTS(WideTargetsPush) {
  uint flagged_count;
  uint target_capacity;
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
  uint of_pairs;     // else of proposals
  uint capacity;     // of their buffer
  uint most_groups;  // in one dimension of a dispatch
  uint most_items;   // of one dispatch
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
  uint first_pair;    // of the range; for listed pairs: the list's first entry
  uint pair_count;    // none (0xffffffff): as many as the counters say
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
  uint first;  // entry of the buffer of flagged pairs
  uint count;
};
#endif

#if LAYOUT_CPLUSPLUS || defined(PUSH_RADIX)
PUSH_CONSTANTS(RadixPush) {
  uint item_count;
  uint run_count;
  uint shift;  // of the digit within the key
};
#endif

LAYOUT_END

#ifdef __cplusplus
namespace bisector::host {

// In GLSL blocks are laid out by std430: scalars of four bytes follow each other, and a vec3 starts at a multiple of 16
// bytes and takes 12.
static_assert(sizeof(float) == sizeof(uint) && sizeof(vec3) == 3 * sizeof(float) && alignof(vec3) == alignof(float));
static_assert(sizeof(CountPush) == 4 && sizeof(CellsPush) == 4);
static_assert(sizeof(GridPush) == 24 && offsetof(GridPush, grid_lower) == 0 && offsetof(GridPush, grid_inverse) == 12 &&
              offsetof(GridPush, bucket_mask) == 16 && offsetof(GridPush, seed_count) == 20);
static_assert(sizeof(NeighboursPush) == 40 && offsetof(NeighboursPush, grid_lower) == 0 &&
              offsetof(NeighboursPush, residual) == 24 && offsetof(NeighboursPush, target_capacity) == 36);
static_assert(sizeof(OwnersPush) == 40 && offsetof(OwnersPush, grid_lower) == 0 &&
              offsetof(OwnersPush, residual) == 24 && offsetof(OwnersPush, report_uncertain) == 36);
static_assert(sizeof(WideTargetsPush) == 8 && offsetof(WideTargetsPush, target_capacity) == 4);
static_assert(sizeof(StartFacetsPush) == 20 && offsetof(StartFacetsPush, pair_capacity) == 16);
static_assert(sizeof(StartSamplesPush) == 16 && offsetof(StartSamplesPush, proposal_capacity) == 12);
static_assert(sizeof(StartTetsPush) == 12 && offsetof(StartTetsPush, proposal_capacity) == 8);
static_assert(sizeof(AdvancePush) == 16 && offsetof(AdvancePush, most_items) == 12);
static_assert(sizeof(AdmitPush) == 8 && offsetof(AdmitPush, pair_capacity) == 4);
static_assert(sizeof(ClipPush) == 32 && offsetof(ClipPush, residual) == 4 && offsetof(ClipPush, cell_count) == 28);
static_assert(sizeof(DoubtfulPush) == 20 && offsetof(DoubtfulPush, mean_density) == 12 &&
              offsetof(DoubtfulPush, share) == 16);
static_assert(sizeof(GatherPairsPush) == 8 && offsetof(GatherPairsPush, count) == 4);
static_assert(sizeof(RadixPush) == 12 && offsetof(RadixPush, shift) == 8);

}  // namespace bisector::host
#endif
#endif
