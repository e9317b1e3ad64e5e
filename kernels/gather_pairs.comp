#version 460
#extension GL_GOOGLE_include_directive : require
// The pairs that a list names: their places, elements and slots.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Flagged { uint flagged[]; };
layout(std430, binding = 1) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 2) writeonly buffer Gathered { uint gathered[]; };
#define PUSH_GATHER_PAIRS
#include "layout/push.h"

void main() {
  const uint index = invocation();
  if (index >= count) return;
  const uint pair = flagged[first + index];
  gathered[kGatheredWords * index] = pair;
  gathered[kGatheredWords * index + 1] = pairs[pair].x;
  gathered[kGatheredWords * index + 2] = pairs[pair].y;
}
