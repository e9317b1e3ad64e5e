// Adds 1 to each value, in the precision of the build.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "real.glsl"

layout(local_size_x = 64) in;

layout(std430, set = 0, binding = 0) buffer Values { real values[]; };
layout(push_constant) uniform Push { uint count; };

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64 + gl_LocalInvocationID.x;
  if (i >= count) return;
  precise real sum = values[i] + real(1);
  values[i] = sum;
}
