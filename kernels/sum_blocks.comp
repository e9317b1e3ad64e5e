#version 460
#extension GL_GOOGLE_include_directive : require
// The next level of sums: of blocks of kSumBlock of them, of several kinds.
#include "common.glsl"
#include "double.glsl"

layout(std430, binding = 0) readonly buffer Terms { double terms[]; };  // of a kind one after the other
layout(std430, binding = 1) writeonly buffer Sums { double sums[]; };
#define PUSH_SUMS
#include "layout/push.h"

void main() {
  const uint blocks = (count + kSumBlock - 1) / kSumBlock;
  const uint kind = invocation() / blocks, block = invocation() % blocks;
  if (kind >= kinds) return;
  const uint first = block * kSumBlock;
  precise double sum = terms[kind * count + first];
  [[dont_unroll]] for (uint k = 1; k < min(kSumBlock, count - first); ++k) sum = sum + terms[kind * count + first + k];
  sums[kind * blocks + block] = sum;
}
