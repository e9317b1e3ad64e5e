#version 460
#extension GL_GOOGLE_include_directive : require
// Where each seed's triangles are listed, from what is known by slot.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Begins { uint begins[]; };  // of each slot's triangles
layout(std430, binding = 1) readonly buffer Order { uint order[]; };    // the caller's index of each slot
layout(std430, binding = 2) writeonly buffer Ranges { uvec2 ranges[]; };
#define PUSH_COUNT
#include "layout/push.h"

void main() {
  const uint slot = invocation();
  if (slot < count) ranges[order[slot]] = uvec2(begins[slot], begins[slot + 1]);
}
