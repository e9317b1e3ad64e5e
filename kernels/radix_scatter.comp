#version 460
#extension GL_GOOGLE_include_directive : require
// Moves the items to their places, in order.
#include "common.glsl"
#include "radix.glsl"

layout(std430, binding = 0) readonly buffer Items { uvec2 items[]; };
layout(std430, binding = 1) readonly buffer Places { uint places[]; };
layout(std430, binding = 2) writeonly buffer Sorted { uvec2 sorted[]; };

void main() {
  const uint run = invocation();
  if (run >= run_count) return;
  uint next[kRadixDigits];
  for (uint d = 0; d < kRadixDigits; ++d) next[d] = places[d * run_count + run];
  const uint end = min(item_count, (run + 1) * kRadixRun);
  [[dont_unroll]] for (uint k = run * kRadixRun; k < end; ++k) {
    const uvec2 item = items[k];
    sorted[next[digit_of(item.x)]++] = item;
  }
}
