#version 460
#extension GL_GOOGLE_include_directive : require
// Incident pairs in the order of triangles or of cells; those of one triangle or cell come in any order. By triangles,
// the stable sort by cells that follows takes that away, for they have different cells. `places` starts as where the
// pairs of each triangle or cell begin.
#include "common.glsl"

layout(constant_id = 0) const bool kByTriangle = false;

layout(std430, binding = 0) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 1) readonly buffer Status { uint status_of[]; };
layout(std430, binding = 2) readonly buffer Triangles { uint triangle_of[]; };
layout(std430, binding = 3) buffer Places { uint places[]; };
layout(std430, binding = 4) writeonly buffer Items { uvec2 items[]; };  // slot, or triangle; then pair
#define PUSH_COUNT
#include "layout/push.h"

void main() {
  const uint pair = invocation();
  if (pair >= count || status_of[pair] == kStatusEmpty) return;
  const uvec2 names = pairs[pair];
  const uint triangle = triangle_of[names.x];
  if (kByTriangle) items[atomicAdd(places[triangle], 1u)] = uvec2(names.y, pair);
  else items[atomicAdd(places[names.y], 1u)] = uvec2(triangle, pair);
}
