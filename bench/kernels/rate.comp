#version 460
#extension GL_GOOGLE_include_directive : require
// Multiplications and additions that nothing may fuse, as those of all kernels, in eight chains per invocation.
#include "common.glsl"
#include "real.glsl"

layout(std430, binding = 0) buffer Values { real values[]; };
#define PUSH_COUNT
#include "layout/push.h"

const uint kInvocations = 1u << 17;

void main() {
  const uint index = invocation();
  if (index >= kInvocations) return;
  real x[8];
  for (uint k = 0; k < 8; ++k) x[k] = real(index + k);
  [[dont_unroll]] for (uint step = 0; step < count; ++step) {
    for (uint k = 0; k < 8; ++k) {
      precise real next = x[k] * real(0.5) + real(1.0);
      x[k] = next;
    }
  }
  real sum = real(0.0);
  for (uint k = 0; k < 8; ++k) sum += x[k];
  values[index] = sum;
}
