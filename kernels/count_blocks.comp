#version 460
#extension GL_GOOGLE_include_directive : require
// Blocks of 32 terms per cell.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Begins { uint begins[]; };  // of each cell's terms, and the end of the last
layout(std430, binding = 1) writeonly buffer Blocks { uint blocks[]; };
layout(push_constant) uniform Push { uint cell_count; };

void main() {
  const uint cell = invocation();
  if (cell > cell_count) return;
  blocks[cell] = cell == cell_count ? 0 : (begins[cell + 1] - begins[cell] + 31) / 32;
}
