#version 460
#extension GL_GOOGLE_include_directive : require
// Clips pairs of a facet and a cell, integrates, and proposes the cells that the polygon borders on. A pair that cannot be
// certified is listed for the next rung instead.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(constant_id = 0) const uint kMostCorners = 16;
layout(constant_id = 1) const bool kUniform = true;
layout(constant_id = 2) const uint kRung = 0;        // 0: first lists; 1: wider lists; 2: double after single
layout(constant_id = 3) const bool kListed = false;  // the pairs are those of a list, not a range
layout(constant_id = 4) const bool kLabels = false;  // writes labels, and nothing else
layout(constant_id = 5) const bool kNarrow = false;  // moments are kept in single precision
layout(constant_id = 6) const bool kDoubleNext = false;  // uncertain pairs go to the rung of double precision

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Ids { uvec4 ids[]; };
layout(std430, binding = 2) readonly buffer Facets { real facet_words[]; };
layout(std430, binding = 3) readonly buffer FacetMeta { uint facet_meta[]; };
layout(std430, binding = 4) readonly buffer Info { uvec4 list_info[]; };
// In single, per cell: the bits of the largest errors of mass and of energy that its pairs may have.
layout(std430, binding = 5) buffer Doubts { uint doubts[]; };
layout(std430, binding = 6) readonly buffer Lists { uint lists[]; };
layout(std430, binding = 7) readonly buffer WideLists { uint wide_lists[]; };
layout(std430, binding = 8) readonly buffer Pairs { uvec2 pairs[]; };       // facet, slot
layout(std430, binding = 9) buffer Status { uint status_of[]; };
layout(std430, binding = 10) writeonly buffer MassSecond { uint mass_second[]; };
layout(std430, binding = 11) writeonly buffer First { uint first_moments[]; };
layout(std430, binding = 12) writeonly buffer Proposals { uvec2 proposals[]; };
layout(std430, binding = 13) buffer Counters { uint counters[]; };
layout(std430, binding = 14) buffer Flagged { uint flagged[]; };            // three regions: short lists, uncertain, for the CPU
layout(std430, binding = 15) writeonly buffer Labels { uint labels[]; };    // per pair: count or kNone, then the labels
layout(push_constant) uniform Push {
  uint facet_base;
  float residual;
  uint two;
  uint first_pair;      // of the range; kListed: the region's first entry
  uint pair_count;      // kNone: as many as the counters say
  uint proposal_room;
  uint flagged_room;    // entries of one region
  uint cell_count;
};
#include "counters.glsl"
#include "facet.glsl"
LOAD_POINT(seed, seed_words)

const uint kMostListed = 512;  // work is bounded; a Delaunay ring may be longer

uint list_first;
bool list_wide;
uint neighbour(uint k) { return list_wide ? wide_lists[list_first + k] : lists[list_first + k]; }

#include "clipper.glsl"
#include "moments_store.glsl"

void propose(uint facet) {
  uint count = 0;
  [[dont_unroll]] for (uint k = 0; k < corner_count; ++k)
    if ((corner_label[k] & kEdgeLabel) == 0) ++count;
  if (count == 0) return;
  uint at = atomicAdd(counters[kProposals], count);
  if (at + count > proposal_room) {
    atomicOr(counters[kOverflow], kOverflowProposals);
    return;
  }
  [[dont_unroll]] for (uint k = 0; k < corner_count; ++k)
    if ((corner_label[k] & kEdgeLabel) == 0) proposals[at++] = uvec2(facet, corner_label[k]);
}

void flag(uint region, uint counter, uint pair) {
  flagged[region * flagged_room + atomicAdd(counters[counter], 1u)] = pair;
}

void main() {
  const uint index = invocation();
  uint pair;
  if (kListed) {
    if (index >= pair_count) return;
    pair = flagged[first_pair + index];
  } else {
    pair = (pair_count == kNone ? counters[kPairsBegin] : first_pair) + index;
    if (pair >= (pair_count == kNone ? counters[kPairsEnd] : first_pair + pair_count)) return;
  }
  const uint facet = pairs[pair].x, slot = pairs[pair].y;
  if (kLabels && status_of[pair] == kEmpty) {
    labels[index * (kMostCorners + 1)] = 0;
    return;
  }
  const uvec4 info = list_info[slot];
  list_wide = (info.x & kWideList) != 0;
  list_first = info.x & ~kWideList;
  begin_facet(facet, slot);
  uint status = info.y > kMostListed ? kUnsure : clip(info.y, real(uintBitsToFloat(info.z)));
  if (!loops_complete(two)) status = kUnsure;
  if (kLabels) {
    const uint at = index * (kMostCorners + 1);
    labels[at] = status == kClipped ? corner_count : status == kEmpty ? 0 : kNone;
    if (status == kClipped) {
      [[dont_unroll]] for (uint k = 0; k < corner_count; ++k) labels[at + 1 + k] = corner_label[k];
    }
    return;
  }
  status_of[pair] = status;
  if (kRung != 2 && status == kUnsure) atomicAdd(counters[kUnsureMet], 1u);
  if (kRung == 2 && status != kClipped && status != kEmpty) atomicAdd(counters[kUnsettled], 1u);
  if (status == kClipped) {
    store_moments(pair, integrate(kUniform));
#if !BISECTOR_DOUBLE
    const real error = mass_error();
    precise real energy_error = error * reach;
    atomicMax(doubts[2 * slot], floatBitsToUint(error));
    atomicMax(doubts[2 * slot + 1], floatBitsToUint(energy_error));
#endif
    propose(facet);
  } else if (kRung == 0 && (status == kShortList || status == kCrowded)) {
    flag(0, kShort, pair);
  } else if (kDoubleNext && status == kUnsure) {
    flag(1, kUncertain, pair);
  } else if (status != kEmpty) {
    flag(2, kForCpu, pair);
  }
}
