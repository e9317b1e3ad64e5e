#version 460
#extension GL_GOOGLE_include_directive : require
// Lists the pairs of cells whose masses or energies single precision may have off by too much.
#include "common.glsl"

layout(constant_id = 0) const bool kDoubleNext = false;
layout(constant_id = 1) const bool kSolid = false;  // masses are volumes, not areas

// Of a cell's. Masses are found to be off by a fiftieth of their bounds or less, energies, whose bounds take all of a
// polygon for as far off as its farthest corner, by less still. The bounds of polyhedra, whose vertices have more to be
// off by, are found to be five hundred times too large and more.
const float kMassError = kSolid ? 3e-3 : 4e-4, kEnergyError = kSolid ? 9e-3 : 1.2e-3;

layout(std430, binding = 0) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 1) readonly buffer Status { uint status_of[]; };
layout(std430, binding = 2) readonly buffer CellErrors { uint cell_errors[]; };
layout(std430, binding = 3) readonly buffer Cells { float cells[]; };  // by the caller's index
layout(std430, binding = 4) buffer Counters { uint counters[]; };
layout(std430, binding = 5) writeonly buffer Flagged { uint flagged[]; };
layout(std430, binding = 6) readonly buffer Ids { uvec4 ids[]; };
#define PUSH_DOUBTFUL
#include "layout/push.h"
#include "layout/counters.h"

void main() {
  const uint index = invocation();
  if (index >= pair_count) return;
  const uint pair = first_pair + index, slot = pairs[pair].y;
  if (status_of[pair] != kStatusClipped) return;
  const uint cell = kCellWords * ids[slot].x;
  const float mass = max(cells[cell], cells[cell + kCellStepMassAt]);
  const float extent = mass / mean_density;
  precise float energy =
      max(cells[cell + kSecondMomentAt], mass * (kSolid ? pow(extent, 2.0 / 3.0) : extent));
  precise float most_mass = kMassError * share * mass;
  precise float most_energy = kEnergyError * share * energy;
  if (!(uintBitsToFloat(cell_errors[kCellErrorWords * slot]) > most_mass) &&
      !(uintBitsToFloat(cell_errors[kCellErrorWords * slot + kEnergyErrorAt]) > most_energy))
    return;
  const uint list = kDoubleNext ? kFlaggedUncertain : kFlaggedForCpu;
  const uint at = atomicAdd(counters[kDoubleNext ? kUnsure : kForCpu], 1u);
  if (at < flagged_capacity) flagged[list * flagged_capacity + at] = pair;
}
