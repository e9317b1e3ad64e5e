#version 460
#extension GL_GOOGLE_include_directive : require
// Lists each cell once that needs a wider list and has none yet.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Flagged { uint flagged[]; };
layout(std430, binding = 1) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 2) buffer Wide { uint wide[]; };  // per slot: 1 once it is listed
layout(std430, binding = 3) writeonly buffer Targets { uint targets[]; };
layout(std430, binding = 4) buffer Counters { uint counters[]; };
#define PUSH_WIDE_TARGETS
#include "layout/push.h"
#include "layout/counters.h"

void main() {
  const uint item = counters[kShortLists + kBeginAfter] + invocation();
  if (item >= counters[kShortLists + kEndAfter]) return;
  const uint slot = pairs[flagged[first_flagged + item] & ~kAgainInDouble].y;
  if (atomicExchange(wide[slot], 1u) != 0) return;
  const uint at = atomicAdd(counters[kWideTargets], 1u);
  if (at < target_capacity) targets[at] = slot;
}
