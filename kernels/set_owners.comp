#version 460
#extension GL_GOOGLE_include_directive : require
// Stores the owners of points that were found on the CPU.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Found { uvec2 found[]; };  // point, slot
layout(std430, binding = 1) writeonly buffer Owners { uint owners[]; };
#define PUSH_COUNT
#include "layout/push.h"

void main() {
  const uint index = invocation();
  if (index < count) owners[found[index].x] = found[index].y;
}
