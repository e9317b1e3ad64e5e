#version 460
#extension GL_GOOGLE_include_directive : require
// Lists of cells whose last list was too short, each by a workgroup: the nearest seeds in ascending distance with a
// certificate, as in neighbours.comp. Seeds nearer than the farthest of the list are collected, sorted and merged into
// it, first those near in the order of slots, then those of the tree's leaves within that distance.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(constant_id = 0) const uint kWide = 128;  // entries of a list that is not the widest, a power of two
layout(constant_id = 1) const uint kMostRounds = 96;  // through the stack

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Ids { uvec4 ids[]; };
layout(std430, binding = 2) readonly buffer Boxes { float boxes[]; };
layout(std430, binding = 3) writeonly buffer WideLists { uint wide_lists[]; };
layout(std430, binding = 4) buffer Info { uvec4 list_info[]; };  // ListInfo
layout(std430, binding = 5) buffer Counters { uint counters[]; };
layout(std430, binding = 6) readonly buffer Targets { uint targets[]; };
#define PUSH_WIDE_LISTS
#include "layout/push.h"
#include "layout/counters.h"
#include "seed_tree.glsl"
LOAD_POINT(seed, seed_words)

#include "nearest.glsl"

const uint kBatch = kGroupSize * kTreeArity;  // of seeds, a leaf for each invocation
const uint kStack = 512;                      // nodes that are still to be looked at
const uint kReserved = 96;                    // of them, for what one node at a time may add
const uint kLevelShift = 28;

// The list, ascending, and from kNew on what was collected for it.
const uint kNew = kWidestList;
shared float squares[kNew + kBatch];
shared uint found[kNew + kBatch];
shared uint stack[kStack];
shared uint stack_size, first_held, new_count, list_first, swaps, least_left_out, incomplete;

uint lane, most, own_slot;
Point own;
float left_out = kFarthest;  // the least square of a seed that this invocation left out of the list

// Puts what lies at two places in order, the nearer first or last.
void order(uint a, uint b, bool nearer_first) {
  const float square_a = squares[a], square_b = squares[b];
  const uint found_a = found[a], found_b = found[b];
  if ((square_a > square_b || (square_a == square_b && found_a > found_b)) != nearer_first) return;
  squares[a] = square_b;
  squares[b] = square_a;
  found[a] = found_b;
  found[b] = found_a;
}

void collect(uint leaf) {
  const uint end = min((leaf + 1) * kTreeArity, seed_count);
  [[dont_unroll]] for (uint other = leaf * kTreeArity; other < end; ++other) {
    if (other == own_slot) continue;
    const float squared = narrow_square(difference(seed(other), own));
    if (squared >= squares[most - 1]) {
      left_out = min(left_out, squared);
      continue;
    }
    const uint at = kNew + atomicAdd(new_count, 1u);
    squares[at] = squared;
    found[at] = other;
  }
}

// The lower of the two places that the i-th comparison at a distance of `apart`, a power of two, is of.
uint lower_place(uint i, uint apart) { return 2 * i - (i & (apart - 1)); }

// Sorts what was collected, by Batcher's bitonic network, and merges it into the list.
void merge() {
  barrier();
  const uint count = new_count;
  if (count > 0) {
    uint size = 2;
    [[dont_unroll]] while (size < count) size *= 2;
    [[dont_unroll]] for (uint k = count + lane; k < size; k += kGroupSize) {
      squares[kNew + k] = kFarthest;
      found[kNew + k] = kNone;
    }
    barrier();
    [[dont_unroll]] for (uint run = 2; run <= size; run *= 2) {
      [[dont_unroll]] for (uint apart = run / 2; apart > 0; apart /= 2) {
        [[dont_unroll]] for (uint i = lane; i < size / 2; i += kGroupSize) {
          const uint a = lower_place(i, apart);
          order(kNew + a, kNew + a + apart, (a & run) == 0);
        }
        barrier();
      }
    }
    // The nearest of both, ascending and then descending or the other way round, which one more merge sorts.
    [[dont_unroll]] for (uint i = lane; i < min(size, most); i += kGroupSize) {
      order(most - 1 - i, kNew + i, true);
      left_out = min(left_out, squares[kNew + i]);
    }
    if (size > most) left_out = min(left_out, squares[kNew + most]);
    barrier();
    [[dont_unroll]] for (uint apart = most / 2; apart > 0; apart /= 2) {
      [[dont_unroll]] for (uint i = lane; i < most / 2; i += kGroupSize) {
        const uint a = lower_place(i, apart);
        order(a, a + apart, true);
      }
      barrier();
    }
  }
  if (lane == 0) new_count = 0;
  barrier();
}

// Goes through the tree from the top; false if there were too many boxes to look at.
bool search(uint begin, uint end) {
  const vec3 at = vec3(own.high);
  if (lane == 0) {
    stack[0] = top_level << kLevelShift;
    stack_size = top_level > 0 ? 1 : 0;
  }
  barrier();
  [[dont_unroll]] for (uint round = 0; round < kMostRounds; ++round) {
    const uint size = stack_size;
    if (size == 0) return true;
    const uint top = lane < size ? stack[size - 1 - lane] : 0;
    const uint level = top >> kLevelShift, node = top & ((1u << kLevelShift) - 1);
    const bool near = lane < size && box_distance(level, node, at) <= squares[most - 1];
    if (lane == 0) first_held = min(size, kGroupSize);
    barrier();
    // Boxes whose parts there is no room for are held back, all but one; leaves and what is too far take none.
    const uint room = size + kReserved < kStack ? (kStack - kReserved - size) / (kTreeArity - 1) : 0;
    if (near && level > 0 && lane >= max(room, 1u)) atomicMin(first_held, lane);
    barrier();
    const uint taken = first_held;
    if (lane == 0) stack_size = size - taken;
    barrier();
    if (near && lane < taken) {
      if (level == 0) {
        collect(node);
      } else {
        const uint last = min((node + 1) * kTreeArity, nodes_of(level - 1));
        [[dont_unroll]] for (uint child = node * kTreeArity; child < last; ++child) {
          if (level == 1 && child >= begin && child < end) continue;
          if (box_distance(level - 1, child, at) <= squares[most - 1])
            stack[atomicAdd(stack_size, 1u)] = (level - 1) << kLevelShift | child;
        }
      }
    }
    merge();
  }
  return false;
}

// Neighbouring entries change places until all are in order.
void sort_doubtful(uint count) {
  [[dont_unroll]] for (uint round = 0; round < count; ++round) {
    if (lane == 0) swaps = 0;
    barrier();
    [[dont_unroll]] for (uint odd = 0; odd < 2; ++odd) {
      [[dont_unroll]] for (uint k = 2 * lane + odd; k + 1 < count; k += 2 * kGroupSize) {
        if (!in_doubt(squares[k], squares[k + 1])) continue;
        const uint a = found[k], b = found[k + 1];
        if (!farther(a, b, own)) continue;
        const float square = squares[k];
        squares[k] = squares[k + 1];
        squares[k + 1] = square;
        found[k] = b;
        found[k + 1] = a;
        swaps = 1;
      }
      barrier();
    }
    const bool done = swaps == 0;
    barrier();
    if (done) return;
  }
}

void main() {
  lane = lane_of_workgroup();
  const uint target = counters[kWideTargets + kBeginAfter] + workgroup();
  if (target >= counters[kWideTargets + kEndAfter]) return;
  own_slot = targets[target];
  own = seed(own_slot);
  const uint width = list_info[own_slot].w + 1;
  const bool widest = width == kListWidest;
  most = widest ? kWidestList : kWide;
  [[dont_unroll]] for (uint k = lane; k < most; k += kGroupSize) {
    squares[k] = kFarthest;
    found[k] = kNone;
  }
  if (lane == 0) {
    new_count = incomplete = 0;
    least_left_out = floatBitsToUint(kFarthest);
    list_first = atomicAdd(counters[kWideEntries], most);
  }
  barrier();
  const uint leaves = nodes_of(0), home = own_slot / kTreeArity, near = widest ? 3 * kGroupSize : kWide / 4;
  const uint begin = min(home - min(home, near / 2), leaves - min(leaves, near)), end = min(begin + near, leaves);
  [[dont_unroll]] for (uint first = begin; first < end; first += kGroupSize) {
    if (first + lane < end) collect(first + lane);
    merge();
  }
  const bool searched = search(begin, end);
  atomicMin(least_left_out, floatBitsToUint(left_out));
  if (!loops_complete(two)) incomplete = 1;
  barrier();
  // As in neighbours.comp, of seeds at the same distance all are listed or none.
  const float farthest = squares[most - 1];
  uint count = min(seed_count - 1, most);
  if (uintBitsToFloat(least_left_out) <= farthest) {
    [[dont_unroll]] while (count > 0 && squares[count - 1] >= farthest) --count;
  }
  const uint first = list_first;
  // A list that there is no memory for, nor can be, is empty.
  const bool fits = first + most <= wide_capacity;
  if (!fits && may_grow != 0) atomicOr(counters[kOverflow], kOverflowWide);
  const bool complete = searched && fits && incomplete == 0;
  if (complete) {
    sort_doubtful(count);
    [[dont_unroll]] for (uint k = lane; k < count; k += kGroupSize) wide_lists[first + k] = found[k];
  }
  if (lane == 0) {
    const float limit = count < seed_count - 1 ? certain_square(farthest) : float(kInfinity);
    list_info[own_slot] = uvec4(first, complete ? count : 0, floatBitsToUint(complete ? limit : 0.0), width);
  }
}
