#version 460
#extension GL_GOOGLE_include_directive : require
// Puts the seeds into their buckets. `places` starts as the buckets' beginnings and ends as their ends.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) buffer Places { uint places[]; };
layout(std430, binding = 2) writeonly buffer Slots { uint bucket_slots[]; };
#define PUSH_GRID
#include "layout/push.h"
#include "grid.glsl"
LOAD_POINT(seed, seed_words)

void main() {
  const uint i = invocation();
  if (i < seed_count) bucket_slots[atomicAdd(places[bucket_of(cell_at(seed(i)))], 1u)] = i;
}
