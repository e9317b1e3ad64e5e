#version 460
#extension GL_GOOGLE_include_directive : require
// What leaves the device: the moments of each cell, and a median of the masses nearby, for steps that do not vanish
// with a cell.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(constant_id = 0) const bool kMedians = true;  // the lists are of the nearest seeds

const uint kNear = 6;  // neighbours whose masses the median is of

layout(std430, binding = 0) readonly buffer Begins { uint begins[]; };  // of each cell's one sum, if it has any
layout(std430, binding = 1) readonly buffer Sums { real sums[]; };
layout(std430, binding = 2) readonly buffer Info { uvec4 list_info[]; };
layout(std430, binding = 3) readonly buffer Lists { uint lists[]; };
layout(std430, binding = 4) readonly buffer WideLists { uint wide_lists[]; };
layout(std430, binding = 5) writeonly buffer Cells { real cells[]; }; 
#define PUSH_CELLS
#include "layout/push.h"

real mass_of(uint cell) { return begins[cell] == begins[cell + 1] ? real(0.0) : sums[kMomentWords * begins[cell]]; }

void main() {
  const uint cell = invocation();
  if (cell >= cell_count) return;
  const bool empty = begins[cell] == begins[cell + 1];
  for (uint k = 0; k < kMomentWords; ++k)
    cells[kCellWords * cell + k] = empty ? real(0.0) : sums[kMomentWords * begins[cell] + k];
  real median = real(-1.0);
  const uvec4 info = list_info[cell];
  if (kMedians && (info.y >= kNear || real(uintBitsToFloat(info.z)) >= kInfinity)) {
    real masses[kNear];
    const uint count = min(info.y, kNear);
    for (uint k = 0; k < count; ++k) {
      const uint first = info.x & ~kWideList;
      const real mass = mass_of((info.x & kWideList) != 0 ? wide_lists[first + k] : lists[first + k]);
      uint m = k;
      for (; m > 0 && masses[m - 1] > mass; --m) masses[m] = masses[m - 1];
      masses[m] = mass;
    }
    median = count == 0 ? real(0.0) : masses[count / 2];
  }
  cells[kCellWords * cell + kCellMedianAt] = median;
}
