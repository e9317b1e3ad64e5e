#version 460
#extension GL_GOOGLE_include_directive : require
// Exclusive prefix sums within blocks of kScanBlock values, in place, and each block's total.
#include "common.glsl"

layout(std430, binding = 0) buffer Values { uint values[]; };
layout(std430, binding = 1) writeonly buffer Totals { uint totals[]; };
#define PUSH_COUNT
#include "layout/push.h"

shared uint sums[kGroupSize];

void main() {
  const uint block = workgroup(), lane = lane_of_workgroup();
  const uint first = (block * kGroupSize + lane) * kScanLane;
  uint own = 0;
  [[dont_unroll]] for (uint k = 0; k < kScanLane; ++k)
    if (first + k < count) own += values[first + k];
  sums[lane] = own;
  barrier();
  [[dont_unroll]] for (uint step = 1; step < kGroupSize; step *= 2) {
    const uint before = lane >= step ? sums[lane - step] : 0;
    barrier();
    sums[lane] += before;
    barrier();
  }
  uint sum = sums[lane] - own;
  [[dont_unroll]] for (uint k = 0; k < kScanLane; ++k)
    if (first + k < count) {
      const uint value = values[first + k];
      values[first + k] = sum;
      sum += value;
    }
  if (lane == kGroupSize - 1 && block * kGroupSize * kScanLane < count) totals[block] = sum;
}
