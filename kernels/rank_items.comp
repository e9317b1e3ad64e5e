#version 460
#extension GL_GOOGLE_include_directive : require
// Brings each cell's items into ascending triangle index: an item goes behind as many as have a lower one.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 1) readonly buffer Items { uvec2 items[]; };    // triangle, pair: by cell
layout(std430, binding = 2) readonly buffer Begins { uint begins[]; };   // of each cell's items
layout(std430, binding = 3) writeonly buffer Ranked { uvec2 ranked[]; };  // slot, pair
layout(std430, binding = 4) writeonly buffer Sorted { uint sorted_triangles[]; };
layout(std430, binding = 5) buffer Counters { uint counters[]; };
#define PUSH_CELLS
#include "layout/push.h"
#include "layout/counters.h"

void main() {
  const uint k = invocation();
  if (k == 0) counters[kItems] = begins[cell_count];
  if (k >= begins[cell_count]) return;
  const uvec2 item = items[k];
  const uint slot = pairs[item.y].y, begin = begins[slot], end = begins[slot + 1];
  if (end - begin > kMostRanked) {
    if (k == begin) atomicAdd(counters[kLargeCells], 1u);
    return;
  }
  uint before = begin, same = 0;
  [[dont_unroll]] for (uint other = begin; other < end; ++other) {
    const uint triangle = items[other].x;
    if (triangle < item.x) ++before;
    if (triangle == item.x) ++same;
  }
  if (same > 1) atomicAdd(counters[kDuplicatePairs], 1u);
  ranked[before] = uvec2(slot, item.y);
  sorted_triangles[before] = item.x;
}
