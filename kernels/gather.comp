#version 460
#extension GL_GOOGLE_include_directive : require
// Which pairs a list names.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Flagged { uint flagged[]; };
layout(std430, binding = 1) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 2) writeonly buffer Gathered { uint gathered[]; };  // pair, facet, slot
layout(push_constant) uniform Push {
  uint first;
  uint count;
};

void main() {
  const uint index = invocation();
  if (index >= count) return;
  const uint pair = flagged[first + index];
  gathered[3 * index] = pair;
  gathered[3 * index + 1] = pairs[pair].x;
  gathered[3 * index + 2] = pairs[pair].y;
}
