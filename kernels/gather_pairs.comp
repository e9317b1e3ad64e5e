#version 460
#extension GL_GOOGLE_include_directive : require
// The pairs that the CPU is asked about: their places, elements and slots.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Flagged { uint flagged[]; };
layout(std430, binding = 1) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 2) writeonly buffer Gathered { uint gathered[]; };
layout(std430, binding = 3) readonly buffer Counters { uint counters[]; };
#define PUSH_GATHER_PAIRS
#include "layout/push.h"
#include "layout/counters.h"

void main() {
  const uint index = invocation(), item = counters[kForCpu + kBeginAfter] + index;
  if (item >= counters[kForCpu + kEndAfter]) return;
  const uint pair = flagged[first_flagged + item];
  gathered[kGatheredWords * index] = pair;
  gathered[kGatheredWords * index + 1] = pairs[pair].x;
  gathered[kGatheredWords * index + 2] = pairs[pair].y;
}
