#version 460
#extension GL_GOOGLE_include_directive : require
// Sums of up to kMostToFinish terms of several kinds, by one workgroup, and the numbers that are made of them.
#include "common.glsl"
#include "double.glsl"
#include "layout/descent.h"

layout(constant_id = 0) const uint kUse = kStoreSums;

layout(std430, binding = 0) readonly buffer Terms { double terms[]; };  // of a kind one after the other
layout(std430, binding = 1) buffer Numbers { double numbers[]; };
#define PUSH_FINISH
#include "layout/push.h"

shared double sums[kStepSums * kSumBlock];

void main() {
  const uint blocks = (count + kSumBlock - 1) / kSumBlock;
  [[dont_unroll]] for (uint task = gl_LocalInvocationID.x; task < kinds * blocks; task += kGroupSize) {
    const uint kind = task / blocks, first = task % blocks * kSumBlock;
    precise double sum = terms[kind * count + first];
    [[dont_unroll]] for (uint k = 1; k < min(kSumBlock, count - first); ++k)
      sum = sum + terms[kind * count + first + k];
    sums[task] = sum;
  }
  barrier();
  const uint kind = gl_LocalInvocationID.x;
  if (gl_WorkGroupID.x > 0 || kind >= kinds) return;
  precise double sum = sums[kind * blocks];
  [[dont_unroll]] for (uint k = 1; k < blocks; ++k) sum = sum + sums[kind * blocks + k];
  if (kUse == kStoreSums) {
    numbers[place + kind] = sum;
  } else if (kUse == kCoefficientSum) {
    precise double before = onto != 0 ? numbers[place] : 0.0LF;
    precise double coefficient = -(before + multiplier * sum);
    numbers[place] = coefficient;
  } else {
    precise double gamma = multiplier * reciprocal(sum);
    numbers[kGammaAt] = gamma;
  }
}
