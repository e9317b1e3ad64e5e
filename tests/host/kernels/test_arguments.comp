// Workgroups for as many items as the first word of the input says.
#version 460

layout(local_size_x = 64) in;

layout(std430, set = 0, binding = 0) readonly buffer Count { uint count[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Arguments { uint arguments[]; };
layout(push_constant) uniform Push { uint first; };

void main() {
  if (gl_GlobalInvocationID.x != 0) return;
  arguments[first] = (count[0] + 63) / 64;
  arguments[first + 1] = 1;
  arguments[first + 2] = 1;
}
