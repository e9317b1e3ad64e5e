#version 460
#extension GL_GOOGLE_include_directive : require
// The next level of sums: of blocks of kSumBlock of them, of several kinds.
#include "common.glsl"
#include "double.glsl"
#include "block_sum.glsl"

layout(std430, binding = 0) readonly buffer Terms { double terms[]; };  // of a kind one after the other
layout(std430, binding = 1) writeonly buffer Sums { double sums[]; };
#define PUSH_SUMS
#include "layout/push.h"
BLOCK_SUM(sum_of_terms, terms)

void main() {
  const uint blocks = (count + kSumBlock - 1) / kSumBlock;
  const uint kind = invocation() / blocks, block = invocation() % blocks;
  if (kind >= kinds) return;
  const uint first = block * kSumBlock;
  sums[kind * blocks + block] = sum_of_terms(kind * count + first, min(kSumBlock, count - first));
}
