#version 460
#extension GL_GOOGLE_include_directive : require
// The rule of all sums: a cell's terms in ascending triangle index, by blocks of kSumBlock, then the blocks' sums
// likewise. One invocation sums one block of one level.
#include "common.glsl"
#include "real.glsl"

layout(constant_id = 0) const bool kPairsLevel = true;  // the terms are pairs, else the sums of blocks

layout(std430, binding = 0) readonly buffer Begins { uint begins[]; };            // of each cell's terms
layout(std430, binding = 1) readonly buffer BlockBegins { uint block_begins[]; };  // of each cell's blocks
layout(std430, binding = 2) readonly buffer Items { uvec2 items[]; };             // slot, pair: by cell, then triangle
layout(std430, binding = 3) readonly buffer MassSecond { real mass_second[]; };
layout(std430, binding = 4) readonly buffer First { real first_moments[]; };
layout(std430, binding = 5) readonly buffer Terms { real terms[]; };
layout(std430, binding = 6) writeonly buffer Sums { real sums[]; };               // mass, first, second
layout(std430, binding = 7) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 8) readonly buffer Triangles { uint triangle_of[]; };
layout(std430, binding = 9) writeonly buffer Sorted { uint sorted_triangles[]; };
layout(std430, binding = 10) buffer Counters { uint counters[]; };
#define PUSH_CELLS
#include "layout/push.h"
#include "layout/counters.h"

#include "moments.glsl"

Moments term(uint k) {
  Moments m;
  if (kPairsLevel) {
    const uint pair = items[k].y;
    m.mass = mass_second[kMassSecondWords * pair];
    m.first = real3(first_moments[kFirstWords * pair], first_moments[kFirstWords * pair + 1],
                    first_moments[kFirstWords * pair + 2]);
    m.second = mass_second[kMassSecondWords * pair + 1];
  } else {
    m.mass = terms[kMomentWords * k];
    m.first = real3(terms[kMomentWords * k + 1], terms[kMomentWords * k + 2], terms[kMomentWords * k + 3]);
    m.second = terms[kMomentWords * k + kSecondMomentAt];
  }
  return m;
}

uint triangle_at(uint k) { return triangle_of[pairs[items[k].y].x]; }

void main() {
  const uint block = invocation();
  if (block >= block_begins[cell_count]) return;
  // The last cell whose blocks begin at or before this one.
  uint cell = 0, beyond = cell_count;
  [[dont_unroll]] while (cell + 1 < beyond) {
    const uint middle = (cell + beyond) / 2;
    if (block_begins[middle] <= block) cell = middle;
    else beyond = middle;
  }
  const uint begin = begins[cell] + kSumBlock * (block - block_begins[cell]);
  const uint end = min(begin + kSumBlock, begins[cell + 1]);
  if (kPairsLevel) {
    uint before = begin == begins[cell] ? kNone : triangle_at(begin - 1);
    [[dont_unroll]] for (uint k = begin; k < end; ++k) {
      const uint triangle = triangle_at(k);
      if (triangle == before) atomicAdd(counters[kDuplicatePairs], 1u);
      sorted_triangles[k] = before = triangle;
    }
  }
  Moments sum = term(begin);
  [[dont_unroll]] for (uint k = begin + 1; k < end; ++k) {
    const Moments m = term(k);
    precise real mass = sum.mass + m.mass;
    precise real3 first = sum.first + m.first;
    precise real second = sum.second + m.second;
    sum.mass = mass;
    sum.first = first;
    sum.second = second;
  }
  sums[kMomentWords * block] = sum.mass;
  sums[kMomentWords * block + 1] = sum.first.x;
  sums[kMomentWords * block + 2] = sum.first.y;
  sums[kMomentWords * block + 3] = sum.first.z;
  sums[kMomentWords * block + kSecondMomentAt] = sum.second;
}
