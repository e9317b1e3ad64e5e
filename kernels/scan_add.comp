#version 460
#extension GL_GOOGLE_include_directive : require
// Adds to each value what the blocks before its own sum to.
#include "common.glsl"

layout(std430, binding = 0) buffer Values { uint values[]; };
layout(std430, binding = 1) readonly buffer Before { uint before[]; };
#define PUSH_COUNT
#include "layout/push.h"

void main() {
  const uint i = invocation();
  if (i < count) values[i] += before[i / kScanBlock];
}
