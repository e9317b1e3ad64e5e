#version 460
#extension GL_GOOGLE_include_directive : require
// Changes the direction of a descent, and then multiplies it with another vector: the terms of the product, summed over
// blocks of kSumBlock seeds (twin of HostVectors in src/cvt/host_descent.cpp).
#include "common.glsl"
#include "double.glsl"
#include "block_sum.glsl"
#include "layout/descent.h"

layout(constant_id = 0) const uint kUpdate = kNoUpdate;
layout(constant_id = 1) const uint kProduct = kNoProduct;

layout(std430, binding = 0) buffer Direction { double direction[]; };
layout(std430, binding = 1) readonly buffer Numbers { double numbers[]; };
layout(std430, binding = 2) readonly buffer Weights { double weights[]; };
layout(std430, binding = 3) readonly buffer By { double by[]; };        // what the direction is changed by
layout(std430, binding = 4) readonly buffer Factor { double factor[]; };  // of the product
layout(std430, binding = 5) writeonly buffer Sums { double sums[]; };     // of blocks
#define PUSH_DIRECT
#include "layout/push.h"

shared double terms[kGroupSize];
BLOCK_SUM(sum_of_terms, terms)

void main() {
  const uint i = invocation(), lane = lane_of_workgroup(), at = 3 * i;
  if (i < count) {
    precise dvec3 d = dvec3(0.0LF);
    if (kUpdate != kNegateUpdate) d = dvec3(direction[at], direction[at + 1], direction[at + 2]);
    if (kUpdate == kNegateUpdate) d = -dvec3(by[at], by[at + 1], by[at + 2]);
    if (kUpdate == kAddUpdate) d = d + numbers[coefficient] * dvec3(by[at], by[at + 1], by[at + 2]);
    if (kUpdate == kWeighUpdate) d = d * weights[i];
    if (kUpdate == kScaleUpdate) d = d * (numbers[kGammaAt] * weights[i]);
    if (kUpdate != kNoUpdate)
      for (uint k = 0; k < 3; ++k) direction[at + k] = d[k];
    if (kProduct != kNoProduct) {
      const dvec3 v = dvec3(factor[at], factor[at + 1], factor[at + 2]);
      precise double term = kProduct == kDotProduct ? dot3(v, d) : norm2(v) * weights[i];
      terms[lane] = term;
    }
  }
  if (kProduct == kNoProduct) return;
  barrier();
  if (lane >= kGroupSize / kSumBlock) return;
  const uint first = i - lane + lane * kSumBlock;
  if (first >= count) return;
  sums[first / kSumBlock] = sum_of_terms(lane * kSumBlock, min(kSumBlock, count - first));
}
