#version 460
#extension GL_GOOGLE_include_directive : require
// What leaves the device: the moments of each cell, and the mass that scales its seed's step: no less than a quarter of
// the median of the masses nearby, so that steps do not vanish with a cell (twin of src/voronoi/step_mass.h).
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(constant_id = 0) const bool kMedians = true;  // the lists are of the nearest seeds
layout(constant_id = 1) const bool kBySlot = true;   // sums lie by slot; else where a cell's one sum begins

const uint kNear = 6;  // neighbours whose masses the median is of

layout(std430, binding = 0) readonly buffer Begins { uint begins[]; };  // of each cell's terms
layout(std430, binding = 1) readonly buffer Sums { real sums[]; };
layout(std430, binding = 2) readonly buffer Info { uvec4 list_info[]; };
layout(std430, binding = 3) readonly buffer Lists { uint lists[]; };
layout(std430, binding = 4) readonly buffer WideLists { uint wide_lists[]; };
layout(std430, binding = 5) writeonly buffer Cells { real cells[]; };  // by the caller's index
layout(std430, binding = 6) readonly buffer Ids { uvec4 ids[]; };
#define PUSH_CELLS
#include "layout/push.h"

bool is_empty(uint cell) { return begins[cell] == begins[cell + 1]; }
real sum_of(uint cell, uint k) {
  return is_empty(cell) ? real(0.0) : sums[kMomentWords * (kBySlot ? cell : begins[cell]) + k];
}

void main() {
  const uint cell = invocation();
  if (cell >= cell_count) return;
  const uint at = kCellWords * ids[cell].x;
  for (uint k = 0; k < kMomentWords; ++k) cells[at + k] = sum_of(cell, k);
  real step_mass = real(-1.0);
  const uvec4 info = list_info[cell];
  if (kMedians && (info.y >= kNear || real(uintBitsToFloat(info.z)) >= kInfinity)) {
    real masses[kNear];
    const uint count = min(info.y, kNear);
    for (uint k = 0; k < count; ++k) {
      const real mass = sum_of(info.w != kListFirst ? wide_lists[info.x + k] : lists[info.x + k], 0);
      uint m = k;
      for (; m > 0 && masses[m - 1] > mass; --m) masses[m] = masses[m - 1];
      masses[m] = mass;
    }
    precise real share = count == 0 ? real(0.0) : real(0.25) * masses[count / 2];
    step_mass = max(sum_of(cell, 0), share);
  }
  cells[at + kCellStepMassAt] = step_mass;
}
