#version 460
#extension GL_GOOGLE_include_directive : require
// Incident pairs per cell, and per triangle where they are to be sorted by that first.
#include "common.glsl"

layout(constant_id = 0) const bool kByTriangle = false;

layout(std430, binding = 0) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 1) readonly buffer Status { uint status_of[]; };
layout(std430, binding = 2) readonly buffer Triangles { uint triangle_of[]; };  // of a facet
layout(std430, binding = 3) buffer ByTriangle { uint by_triangle[]; };
layout(std430, binding = 4) buffer ByCell { uint by_cell[]; };
#define PUSH_COUNT
#include "layout/push.h"

void main() {
  const uint pair = invocation();
  if (pair >= count || status_of[pair] == kStatusEmpty) return;
  if (kByTriangle) atomicAdd(by_triangle[triangle_of[pairs[pair].x]], 1u);
  atomicAdd(by_cell[pairs[pair].y], 1u);
}
