#version 460
#extension GL_GOOGLE_include_directive : require
// How many blocks of terms each cell has.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Begins { uint begins[]; };  // of each cell's terms, and the end of the last
layout(std430, binding = 1) writeonly buffer Blocks { uint blocks[]; };
#define PUSH_CELLS
#include "layout/push.h"

void main() {
  const uint cell = invocation();
  if (cell > cell_count) return;
  blocks[cell] = cell == cell_count ? 0 : (begins[cell + 1] - begins[cell] + (kSumBlock - 1)) / kSumBlock;
}
