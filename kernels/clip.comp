#version 460
#extension GL_GOOGLE_include_directive : require
// Clips pairs of a facet and a cell, integrates, and proposes the cells that the polygon borders on. A pair that cannot
// be certified is listed for the next rung instead.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(constant_id = 0) const uint kMostCorners = 16;
layout(constant_id = 1) const bool kUniform = true;
layout(constant_id = 2) const uint kRung = kRungFirst;
layout(constant_id = 3) const bool kListed = false;  // the pairs are those of a list, not a range
layout(constant_id = 4) const bool kLabels = false;  // writes labels, and nothing else
layout(constant_id = 5) const bool kNarrow = false;  // moments are kept in single precision
layout(constant_id = 6) const bool kDoubleNext = false;  // uncertain pairs go to the rung of double precision

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Ids { uvec4 ids[]; };
layout(std430, binding = 2) readonly buffer Facets { real facet_words[]; };
layout(std430, binding = 3) readonly buffer FacetMeta { uint facet_meta[]; };
layout(std430, binding = 4) readonly buffer Info { uvec4 list_info[]; };
layout(std430, binding = 5) buffer CellErrors { uint cell_errors[]; };
layout(std430, binding = 6) readonly buffer Lists { uint lists[]; };
layout(std430, binding = 7) readonly buffer WideLists { uint wide_lists[]; };
layout(std430, binding = 8) readonly buffer Pairs { uvec2 pairs[]; };       // facet, slot
layout(std430, binding = 9) buffer Status { uint status_of[]; };
layout(std430, binding = 10) writeonly buffer MassSecond { uint mass_second[]; };
layout(std430, binding = 11) writeonly buffer First { uint first_moments[]; };
layout(std430, binding = 12) writeonly buffer Proposals { uvec2 proposals[]; };
layout(std430, binding = 13) buffer Counters { uint counters[]; };
layout(std430, binding = 14) buffer Flagged { uint flagged[]; };
layout(std430, binding = 15) writeonly buffer Labels { uint labels[]; };
#define PUSH_CLIP
#include "layout/push.h"
#include "layout/counters.h"
#include "facet.glsl"
LOAD_POINT(seed, seed_words)

const uint kMostListed = kWidestList;  // work is bounded; a Delaunay ring may be longer

uint list_first, list_width;
uint neighbour(uint k) { return list_width != kListFirst ? wide_lists[list_first + k] : lists[list_first + k]; }

#include "clipper.glsl"
#include "moments_store.glsl"

void propose(uint facet) {
  uint count = 0;
  [[dont_unroll]] for (uint k = 0; k < corner_count; ++k)
    if ((corner_label[k] & kEdgeLabel) == 0) ++count;
  if (count == 0) return;
  uint at = atomicAdd(counters[kProposals], count);
  if (at + count > proposal_capacity) {
    atomicOr(counters[kOverflow], kOverflowProposals);
    return;
  }
  [[dont_unroll]] for (uint k = 0; k < corner_count; ++k)
    if ((corner_label[k] & kEdgeLabel) == 0) proposals[at++] = uvec2(facet, corner_label[k]);
}

void flag(uint list, uint pair) {
  const uint at = atomicAdd(counters[kWorkWords * (kWorkShort + list)], 1u);
  if (at < flagged_capacity) flagged[list * flagged_capacity + at] = pair;
  else atomicOr(counters[kOverflow], kOverflowFlagged);
}

void main() {
  const uint index = invocation();
  uint pair = first_pair + index;
  if (kLabels) {
    if (index >= pair_count) return;
  } else {
    const uint work = kWorkWords * (!kListed ? kWorkPairs : kRung == kRungDouble ? kWorkUnsure : kWorkShort);
    const uint item = counters[work + kBeginAfter] + index;
    if (item >= counters[work + kEndAfter]) return;
    pair = kListed ? flagged[first_pair + item] : item;
  }
  const bool again = kListed && (pair & kAgainInDouble) != 0;
  if (again && kRung == kRungWide) {
    flag(kFlaggedUncertain, pair);
    return;
  }
  if (again) pair &= ~kAgainInDouble;
  const uint facet = pairs[pair].x, slot = pairs[pair].y;
  if (kLabels && status_of[pair] == kStatusEmpty) {
    labels[index * (kMostCorners + kPolygonHeader)] = 0;
    return;
  }
  const uvec4 info = list_info[slot];
  list_first = info.x;
  list_width = info.w;
  begin_facet(facet, slot);
  uint status = info.y > kMostListed ? kStatusUnsure : clip(info.y, real(uintBitsToFloat(info.z)));
  if (!loops_complete(two)) status = kStatusUnsure;
  if (kLabels) {
    const uint at = index * (kMostCorners + kPolygonHeader);
    labels[at] = status == kStatusClipped ? corner_count : status == kStatusEmpty ? 0 : kNone;
    if (status == kStatusClipped) {
      [[dont_unroll]] for (uint k = 0; k < corner_count; ++k) labels[at + kPolygonHeader + k] = corner_label[k];
    }
    return;
  }
  status_of[pair] = status;
  if (kRung != kRungDouble && status == kStatusUnsure) atomicAdd(counters[kUnsurePairs], 1u);
  if (kRung == kRungDouble && status != kStatusClipped && status != kStatusEmpty)
    atomicAdd(counters[kUnsureInDouble], 1u);
  if (status == kStatusClipped) {
    store_moments(pair, integrate(kUniform));
#if !BISECTOR_DOUBLE
    const real error = mass_error();
    precise real energy_error = error * reach;
    atomicMax(cell_errors[kCellErrorWords * slot], floatBitsToUint(error));
    atomicMax(cell_errors[kCellErrorWords * slot + kEnergyErrorAt], floatBitsToUint(energy_error));
#endif
    propose(facet);
  } else if (kRung == kRungFirst && (status == kStatusShortList || status == kStatusCrowded)) {
    flag(kFlaggedShort, pair);
  } else if (kRung == kRungWide && status == kStatusShortList && list_width != kListWidest) {
    atomicAdd(counters[kShortAgain], 1u);
    flag(kFlaggedShort, pair);
  } else if (kRung == kRungDouble && status == kStatusShortList && list_width != kListWidest && !again) {
    flag(kFlaggedShort, pair | kAgainInDouble);
  } else if (kDoubleNext && status == kStatusUnsure) {
    flag(kFlaggedUncertain, pair);
  } else if (status != kStatusEmpty) {
    flag(kFlaggedForCpu, pair);
  }
}
