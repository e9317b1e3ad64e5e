#version 460
#extension GL_GOOGLE_include_directive : require
// Exclusive prefix sums within blocks of kBlock values, in place, and each block's total.
#include "common.glsl"

const uint kEach = 16;

layout(std430, binding = 0) buffer Values { uint values[]; };
layout(std430, binding = 1) writeonly buffer Totals { uint totals[]; };
layout(push_constant) uniform Push { uint count; };

shared uint sums[64];

void main() {
  const uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  const uint lane = gl_LocalInvocationID.x;
  const uint first = (block * 64 + lane) * kEach;
  uint own = 0;
  [[dont_unroll]] for (uint k = 0; k < kEach; ++k)
    if (first + k < count) own += values[first + k];
  sums[lane] = own;
  barrier();
  [[dont_unroll]] for (uint step = 1; step < 64; step *= 2) {
    const uint before = lane >= step ? sums[lane - step] : 0;
    barrier();
    sums[lane] += before;
    barrier();
  }
  uint sum = sums[lane] - own;
  [[dont_unroll]] for (uint k = 0; k < kEach; ++k)
    if (first + k < count) {
      const uint value = values[first + k];
      values[first + k] = sum;
      sum += value;
    }
  if (lane == 63 && block * 64 * kEach < count) totals[block] = sum;
}
