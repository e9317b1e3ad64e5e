#version 460
#extension GL_GOOGLE_include_directive : require
// Turns what was appended to one kind of work since the last time into the next range of it, and its number of
// workgroups.
#include "common.glsl"

layout(std430, binding = 0) buffer Counters { uint counters[]; };
#define PUSH_ADVANCE
#include "layout/push.h"
#include "layout/counters.h"

void main() {
  if (invocation() != 0) return;
  const uint work = kWorkWords * kind, begin = counters[work + kEndAfter];
  // After an overflow the batch is thrown away, so nothing more is clipped.
  const bool stopped = counters[kOverflow] != 0 && kind != kWorkForCpu;
  const uint count = stopped ? begin : max(min(counters[work], capacity), begin);
  const uint items = min(count - begin, most_items);
  counters[work + kBeginAfter] = begin;
  counters[work + kEndAfter] = begin + items;
  if (kind == kWorkProposals && items > 0) ++counters[kRounds];
  const uint groups = (items + group_items - 1) / group_items, x = min(groups, most_groups);
  const uint arguments = kGroups + 3 * kind;
  counters[arguments] = x;
  counters[arguments + 1] = x == 0 ? 0 : (groups + x - 1) / x;
  counters[arguments + 2] = 1;
}
