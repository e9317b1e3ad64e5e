// Each value from one of another workgroup, so that a step must see all of the step before.
#version 460

layout(constant_id = 0) const uint kFactor = 1;
layout(local_size_x = 64) in;

layout(std430, set = 0, binding = 0) readonly buffer From { uint from[]; };
layout(std430, set = 0, binding = 1) writeonly buffer To { uint to[]; };
layout(push_constant) uniform Push { uint count, shift; };

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64 + gl_LocalInvocationID.x;
  if (i >= count) return;
  to[i] = from[(i + shift) % count] * kFactor + i;
}
