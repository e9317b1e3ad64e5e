#version 460
#extension GL_GOOGLE_include_directive : require
// How often each digit occurs in each run; digits first, so that a prefix sum gives the places to write to.
#include "common.glsl"
#include "radix.glsl"

layout(std430, binding = 0) readonly buffer Items { uvec2 items[]; };
layout(std430, binding = 1) writeonly buffer Counts { uint counts[]; };

void main() {
  const uint run = invocation();
  if (run >= run_count) return;
  uint own[kDigits];
  for (uint d = 0; d < kDigits; ++d) own[d] = 0;
  const uint end = min(item_count, (run + 1) * kRun);
  [[dont_unroll]] for (uint k = run * kRun; k < end; ++k) ++own[digit_of(items[k].x)];
  for (uint d = 0; d < kDigits; ++d) counts[d * run_count + run] = own[d];
}
