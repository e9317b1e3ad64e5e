#version 460
#extension GL_GOOGLE_include_directive : require
// The rule of all sums (sum.comp), of one cell by one invocation: for cells of few terms, whose blocks of blocks of
// kSumBlock make one.
#include "common.glsl"
#include "real.glsl"

layout(std430, binding = 0) readonly buffer Begins { uint begins[]; };  // of each cell's terms
layout(std430, binding = 1) readonly buffer Items { uvec2 items[]; };   // slot, pair: by cell, then triangle
layout(std430, binding = 2) readonly buffer MassSecond { real mass_second[]; };
layout(std430, binding = 3) readonly buffer First { real first_moments[]; };
layout(std430, binding = 4) writeonly buffer Sums { real sums[]; };     // mass, first, second; by slot
#define PUSH_CELLS
#include "layout/push.h"
#include "moments.glsl"

Moments term(uint k) {
  const uint pair = items[k].y;
  Moments m;
  m.mass = mass_second[kMassSecondWords * pair];
  m.first = real3(first_moments[kFirstWords * pair], first_moments[kFirstWords * pair + 1],
                  first_moments[kFirstWords * pair + 2]);
  m.second = mass_second[kMassSecondWords * pair + 1];
  return m;
}

Moments added(Moments a, Moments b) {
  Moments sum;
  precise real mass = a.mass + b.mass;
  precise real3 first = a.first + b.first;
  precise real second = a.second + b.second;
  sum.mass = mass;
  sum.first = first;
  sum.second = second;
  return sum;
}

void main() {
  const uint cell = invocation();
  if (cell >= cell_count) return;
  const uint begin = begins[cell], count = begins[cell + 1] - begin;
  if (count == 0 || count > kMostRanked) return;
  // Of all, of kSumBlock blocks, of a block.
  Moments all, of_blocks, of_block;
  [[dont_unroll]] for (uint k = 0; k < count; ++k) {
    const Moments m = term(begin + k);
    if (k % kSumBlock == 0) of_block = m;
    else of_block = added(of_block, m);
    const uint block = k / kSumBlock;
    const bool last = k + 1 == count;
    if (k % kSumBlock != kSumBlock - 1 && !last) continue;
    if (block % kSumBlock == 0) of_blocks = of_block;
    else of_blocks = added(of_blocks, of_block);
    if (block % kSumBlock != kSumBlock - 1 && !last) continue;
    if (block < kSumBlock) all = of_blocks;
    else all = added(all, of_blocks);
  }
  sums[kMomentWords * cell] = all.mass;
  sums[kMomentWords * cell + 1] = all.first.x;
  sums[kMomentWords * cell + 2] = all.first.y;
  sums[kMomentWords * cell + 3] = all.first.z;
  sums[kMomentWords * cell + kSecondMomentAt] = all.second;
}
