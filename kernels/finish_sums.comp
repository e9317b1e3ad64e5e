#version 460
#extension GL_GOOGLE_include_directive : require
// Sums of up to kMostToFinish terms of several kinds, by one workgroup, and the numbers that are made of them.
#include "common.glsl"
#include "double.glsl"
#include "block_sum.glsl"
#include "layout/descent.h"

layout(constant_id = 0) const uint kUse = kStoreSums;

layout(std430, binding = 0) readonly buffer Terms { double terms[]; };  // of a kind one after the other
layout(std430, binding = 1) buffer Numbers { double numbers[]; };
#define PUSH_FINISH
#include "layout/push.h"

shared double sums[kStepSums * kSumBlock];
BLOCK_SUM(sum_of_terms, terms)
BLOCK_SUM(sum_of_sums, sums)

void main() {
  const uint blocks = (count + kSumBlock - 1) / kSumBlock;
  [[dont_unroll]] for (uint task = lane_of_workgroup(); task < kinds * blocks; task += kGroupSize) {
    const uint kind = task / blocks, first = task % blocks * kSumBlock;
    sums[task] = sum_of_terms(kind * count + first, min(kSumBlock, count - first));
  }
  barrier();
  const uint kind = lane_of_workgroup();
  if (kind >= kinds) return;
  const double sum = sum_of_sums(kind * blocks, blocks);
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
