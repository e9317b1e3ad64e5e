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
  uint own[kRadixDigits];
  for (uint d = 0; d < kRadixDigits; ++d) own[d] = 0;
  const uint end = min(item_count, (run + 1) * kRadixRun);
  [[dont_unroll]] for (uint k = run * kRadixRun; k < end; ++k) ++own[digit_of(items[k].x)];
  for (uint d = 0; d < kRadixDigits; ++d) counts[d * run_count + run] = own[d];
}
