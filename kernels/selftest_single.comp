// Sum, difference and product of pairs, for the host to check.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;

layout(std430, set = 0, binding = 0) readonly buffer Pairs { vec2 pairs[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Results { float results[]; };
#define PUSH_COUNT
#include "layout/push.h"

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64 + gl_LocalInvocationID.x;
  if (i >= count) return;
  float a = pairs[i].x, b = pairs[i].y;
  precise float sum = a + b;
  precise float difference = a - b;
  precise float product = a * b;
  results[3 * i] = sum;
  results[3 * i + 1] = difference;
  results[3 * i + 2] = product;
}
