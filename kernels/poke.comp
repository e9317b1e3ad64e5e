#version 460
#extension GL_GOOGLE_include_directive : require
// Sets single words.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Pokes { uvec2 pokes[]; };  // place, word
layout(std430, binding = 1) writeonly buffer Words { uint words[]; };
layout(push_constant) uniform Push { uint count; };

void main() {
  const uint index = invocation();
  if (index < count) words[pokes[index].x] = pokes[index].y;
}
