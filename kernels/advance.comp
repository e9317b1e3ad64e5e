#version 460
#extension GL_GOOGLE_include_directive : require
// Turns what was appended since the last time into the next range of work, and its number of workgroups.
#include "common.glsl"

layout(std430, binding = 0) buffer Counters { uint counters[]; };
#define PUSH_ADVANCE
#include "layout/push.h"
#include "layout/counters.h"

void main() {
  if (invocation() != 0) return;
  const uint count = of_pairs != 0 ? kPairs : kProposals, begin = of_pairs != 0 ? kPairsBegin : kProposalsBegin;
  const uint arguments = of_pairs != 0 ? kPairGroups : kProposalGroups;
  counters[begin] = counters[begin + 1];
  // After an overflow the batch is thrown away.
  const uint items = min(max(counters[count], counters[begin]) - counters[begin], most_items);
  counters[begin + 1] = counters[kOverflow] != 0 ? counters[begin] : min(counters[begin] + items, capacity);
  const uint groups = (counters[begin + 1] - counters[begin] + gl_WorkGroupSize.x - 1) / gl_WorkGroupSize.x;
  const uint x = min(groups, most_groups);
  counters[arguments] = x;
  counters[arguments + 1] = x == 0 ? 0 : (groups + x - 1) / x;
  counters[arguments + 2] = 1;
}
