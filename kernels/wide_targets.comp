#version 460
#extension GL_GOOGLE_include_directive : require
// Lists the cells of pairs whose list was too short, once for each wider list that they get.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Flagged { uint flagged[]; };
layout(std430, binding = 1) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 2) buffer Wide { uint wide[]; };  // per slot: the list that it has or is listed for
layout(std430, binding = 3) writeonly buffer Targets { uint targets[]; };
layout(std430, binding = 4) buffer Counters { uint counters[]; };
layout(std430, binding = 5) readonly buffer Info { uvec4 list_info[]; };  // ListInfo
#define PUSH_WIDE_TARGETS
#include "layout/push.h"
#include "layout/counters.h"

void main() {
  const uint item = counters[kShortLists + kBeginAfter] + invocation();
  if (item >= counters[kShortLists + kEndAfter]) return;
  const uint slot = pairs[flagged[first_flagged + item] & ~kAgainInDouble].y;
  const uint width = list_info[slot].w + 1;
  if (width > kListWidest || atomicMax(wide[slot], width) >= width) return;
  targets[atomicAdd(counters[kWideTargets], 1u)] = slot;
}
