#version 460
#extension GL_GOOGLE_include_directive : require
// Incident pairs in the order of triangles. Those of one triangle come in any order, which the stable sort by cells
// that follows takes away, for they have different cells. `places` starts as the triangles' beginnings.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 1) readonly buffer Status { uint status_of[]; };
layout(std430, binding = 2) readonly buffer Triangles { uint triangle_of[]; };
layout(std430, binding = 3) buffer Places { uint places[]; };
layout(std430, binding = 4) writeonly buffer Items { uvec2 items[]; };  // slot, pair
#define PUSH_COUNT
#include "layout/push.h"

void main() {
  const uint pair = invocation();
  if (pair >= count || status_of[pair] == kStatusEmpty) return;
  const uvec2 names = pairs[pair];
  items[atomicAdd(places[triangle_of[names.x]], 1u)] = uvec2(names.y, pair);
}
