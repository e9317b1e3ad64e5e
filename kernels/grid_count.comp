#version 460
#extension GL_GOOGLE_include_directive : require
// Seeds per bucket.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) buffer Counts { uint counts[]; };
#define PUSH_GRID
#include "layout/push.h"
#include "grid.glsl"
LOAD_POINT(seed, seed_words)

void main() {
  const uint i = invocation();
  if (i < seed_count) atomicAdd(counts[bucket_of(cell_at(seed(i)))], 1u);
}
