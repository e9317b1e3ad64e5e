#version 460
#extension GL_GOOGLE_include_directive : require
// Makes pairs of the proposals that were not met before in this batch. The table holds places of proposals, which were
// written by an earlier dispatch, so that only the table itself is contended.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Proposals { uvec2 proposals[]; };
layout(std430, binding = 1) buffer Table { uint table[]; };  // 0: free; else a place among the proposals, plus 1
layout(std430, binding = 2) writeonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 3) buffer Counters { uint counters[]; };
#define PUSH_ADMIT
#include "layout/push.h"
#include "layout/counters.h"

const uint kProbes = 256;

void main() {
  const uint place = counters[kProposals + kBeginAfter] + invocation();
  if (place >= counters[kProposals + kEndAfter]) return;
  const uvec2 proposal = proposals[place];
  uint h = proposal.x * 0x9e3779b1u ^ proposal.y * 0x85ebca77u;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  [[dont_unroll]] for (uint probe = 0; probe < kProbes; ++probe) {
    const uint at = (h + probe) & table_mask;
    const uint occupant = atomicCompSwap(table[at], 0u, place + 1);
    if (occupant == 0) {
      const uint pair = atomicAdd(counters[kPairs], 1u);
      if (pair < pair_capacity) pairs[pair] = proposal;
      else atomicOr(counters[kOverflow], kOverflowPairs);
      return;
    }
    if (proposals[occupant - 1] == proposal) return;
  }
  atomicOr(counters[kOverflow], kOverflowTable);
}
