// Which item each invocation takes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(std430, binding = 0) writeonly buffer Items { uint items[]; };
#define PUSH_COUNT
#include "layout/push.h"

void main() {
  const uint place = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * kGroupSize + gl_LocalInvocationID.x;
  if (place < count) items[place] = invocation();
}
