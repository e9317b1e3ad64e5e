#version 460
#extension GL_GOOGLE_include_directive : require
// Clips pairs of a tetrahedron and a cell, integrates, and proposes the pairs that the polyhedron makes known. A pair
// that cannot be certified is listed for the next rung instead.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(constant_id = 0) const uint kMostPlanes = 32;     // 64 at most
layout(constant_id = 1) const uint kMostVertices = 60;   // 2 kMostPlanes - 4, the most that many planes have
layout(constant_id = 2) const bool kUniform = true;
layout(constant_id = 3) const uint kRung = kRungFirst;
layout(constant_id = 4) const bool kListed = false;  // the pairs are those of a list, not a range
layout(constant_id = 5) const bool kLabels = false;  // writes labels, and nothing else
layout(constant_id = 6) const bool kNarrow = false;  // moments are kept in single precision
layout(constant_id = 7) const bool kDoubleNext = false;  // uncertain pairs go to the rung of double precision
layout(constant_id = 8) const bool kWhole = false;  // the only tetrahedron is the enclosure, and cells lie inside it

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Ids { uvec4 ids[]; };
layout(std430, binding = 2) readonly buffer Tets { real tet_words[]; };
layout(std430, binding = 3) readonly buffer TetMeta { uint tet_meta[]; };
layout(std430, binding = 4) readonly buffer Info { uvec4 list_info[]; };
layout(std430, binding = 5) buffer CellErrors { uint cell_errors[]; };
layout(std430, binding = 6) readonly buffer Lists { uint lists[]; };
layout(std430, binding = 7) readonly buffer WideLists { uint wide_lists[]; };
layout(std430, binding = 8) readonly buffer Pairs { uvec2 pairs[]; };       // tetrahedron, slot
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
#include "tet.glsl"
LOAD_POINT(seed, seed_words)

const uint kMostListed = kWidestList;  // work is bounded; a Delaunay ring may be longer

uint list_first, list_width;
uint neighbour(uint k) { return list_width != kListFirst ? wide_lists[list_first + k] : lists[list_first + k]; }

#include "tet_clipper.glsl"
#include "moments_store.glsl"

void propose(uint tet, uint slot) {
  const uint at = atomicAdd(counters[kProposals], 1u);
  if (at < proposal_capacity) proposals[at] = uvec2(tet, slot);
  else atomicOr(counters[kOverflow], kOverflowProposals);
}

// The other cells of the tetrahedron. Of those that are taken whole a neighbour that does not meet the boundary is
// known to lie inside; each is proposed once.
void propose_all(uint tet) {
  [[dont_unroll]] for (uint k = 0; k < bounding_count; ++k) {
    const uint label = plane_label[bounding[k]];
    if ((label & kFacetLabel) != 0) continue;
    if (!kWhole || (atomicOr(cell_errors[kCellErrorWords * cell_count + label], kMarkMet) &
                    (kMarkBoundary | kMarkMet)) == 0)
      propose(tet, label);
  }
}

void flag(uint list, uint pair) {
  const uint at = atomicAdd(counters[kWorkWords * (kWorkShort + list)], 1u);
  if (at < flagged_capacity) flagged[list * flagged_capacity + at] = pair;
  else atomicOr(counters[kOverflow], kOverflowFlagged);
}

bool reaches_enclosure() {
  [[dont_unroll]] for (uint k = 0; k < bounding_count; ++k)
    if ((plane_label[bounding[k]] & kFacetLabel) != 0) return true;
  return false;
}

void write_labels(uint index, uint status) {
  const uint at = index * (kPolyhedronHeader + kMostPlanes + kMostVertices);
  if (status != kStatusClipped) {
    labels[at] = status == kStatusEmpty ? 0 : kNone;
    return;
  }
  labels[at] = bounding_count;
  labels[at + 1] = vertex_count;
  [[dont_unroll]] for (uint k = 0; k < bounding_count; ++k) {
    labels[at + kPolyhedronHeader + k] = plane_label[bounding[k]];
    next_of[bounding[k]] = k;
  }
  [[dont_unroll]] for (uint v = 0; v < vertex_count; ++v) {
    const uvec3 on = planes_of(vertex_on[v]);
    labels[at + kPolyhedronHeader + kMostPlanes + v] = packed(next_of[on.x], next_of[on.y], next_of[on.z]);
  }
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
  const uint tet = pairs[pair].x, slot = pairs[pair].y;
  if (kLabels && (status_of[pair] == kStatusEmpty || status_of[pair] == kStatusWhole)) {
    labels[index * (kPolyhedronHeader + kMostPlanes + kMostVertices)] = 0;
    return;
  }
  begin_tet(tet, slot);
  const uint owner = tet_meta[tet * kTetMetaWords + kTetOwnerAt];
  uint status;
  if (owner != kNone) {
    // A cell is convex: it holds the tetrahedron if it owns the corners.
    status = owner == slot ? kStatusWhole : kStatusEmpty;
  } else {
    const uvec4 info = list_info[slot];
    list_first = info.x;
    list_width = info.w;
    status = info.y > kMostListed ? kStatusUnsure : clip(info.y, real(uintBitsToFloat(info.z)));
  }
  bounding_count = 0;
  Moments moments;
  if (status == kStatusClipped || status == kStatusWhole) {
    collect();
    if (kWhole && reaches_enclosure()) status = kStatusUnsure;
    else if (!kLabels) moments = integrate(kUniform);
  }
  if (!loops_complete(two)) status = kStatusUnsure;
  if (kLabels) {
    write_labels(index, status);
    return;
  }
  status_of[pair] = status;
  if (kRung != kRungDouble && status == kStatusUnsure) atomicAdd(counters[kUnsurePairs], 1u);
  if (kRung == kRungDouble && status != kStatusClipped && status != kStatusEmpty)
    atomicAdd(counters[kUnsureInDouble], 1u);
  if (status == kStatusClipped || status == kStatusWhole) {
    store_moments(pair, moments);
#if !BISECTOR_DOUBLE
    if (status == kStatusClipped) {
      const real error = mass_error();
      precise real energy_error = error * reach;
      atomicMax(cell_errors[kCellErrorWords * slot], floatBitsToUint(error));
      atomicMax(cell_errors[kCellErrorWords * slot + kEnergyErrorAt], floatBitsToUint(energy_error));
    }
#endif
    propose_all(tet);
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
