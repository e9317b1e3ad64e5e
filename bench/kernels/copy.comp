#version 460
#extension GL_GOOGLE_include_directive : require
// Four words for each invocation: nothing but memory is at work.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer From { uvec4 from[]; };
layout(std430, binding = 1) writeonly buffer To { uvec4 to[]; };
#define PUSH_COUNT
#include "layout/push.h"

void main() {
  const uint index = invocation();
  if (index < count) to[index] = from[index];
}
