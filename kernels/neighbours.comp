#version 460
#extension GL_GOOGLE_include_directive : require
// The nearest seeds of a seed in ascending distance, and a certificate: whoever is not listed lies at `radius` or more.
// Seeds near in the order of slots come first, so that few boxes of the tree are left to open. Distances are compared
// in single precision; those that this may have in the wrong order are sorted anew.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(constant_id = 0) const uint kMost = 32;      // entries of a list
layout(constant_id = 1) const uint kMerged = 32;    // the power of two that is not less
layout(constant_id = 2) const uint kOpened = 4096;  // boxes that are looked at

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Ids { uvec4 ids[]; };
layout(std430, binding = 2) readonly buffer Boxes { float boxes[]; };
layout(std430, binding = 3) buffer Lists { uint lists[]; };
layout(std430, binding = 4) writeonly buffer Info { uvec4 list_info[]; };  // ListInfo
layout(std430, binding = 5) buffer Counters { uint counters[]; };
#define PUSH_NEIGHBOURS
#include "layout/push.h"
#include "layout/counters.h"
#include "seed_tree.glsl"
LOAD_POINT(seed, seed_words)

#include "nearest.glsl"

// The nearest seeds so far, ascending. Every place is named by a constant once loops are unrolled, so that all stay in
// registers.
float squares[kMost];
uint found[kMost];
float left_out = kFarthest;  // the least square of a seed that is not among them
float leaf_squares[kTreeArity];
uint leaf_found[kTreeArity];

uint own_slot;
Point own;
bool met = false;  // a seed that this precision cannot tell apart from the own

#define NEARER_FIRST(square_a, a, square_b, b)     \
  {                                                \
    const float low_square = square_a;             \
    const uint low = a;                            \
    const bool swap = square_b < low_square;       \
    square_a = swap ? square_b : low_square;       \
    a = swap ? b : low;                            \
    square_b = swap ? low_square : square_b;       \
    b = swap ? low : b;                            \
  }
#define ORDER_LEAF(k, m) NEARER_FIRST(leaf_squares[k], leaf_found[k], leaf_squares[m], leaf_found[m])

// Batcher's odd-even network for eight.
void sort_leaf() {
  [[unroll]] for (uint k = 0; k < 8; k += 2) ORDER_LEAF(k, k + 1)
  [[unroll]] for (uint k = 0; k < 8; k += 4) {
    ORDER_LEAF(k, k + 2)
    ORDER_LEAF(k + 1, k + 3)
    ORDER_LEAF(k + 1, k + 2)
  }
  [[unroll]] for (uint k = 0; k < 4; ++k) ORDER_LEAF(k, k + 4)
  ORDER_LEAF(2, 4)
  ORDER_LEAF(3, 5)
  [[unroll]] for (uint k = 1; k < 6; k += 2) ORDER_LEAF(k, k + 1)
}

const uint kPadding = kMerged - kMost;  // places before the list
#define MERGE(apart)                                                                     \
  if (apart < kMerged) {                                                                 \
    [[unroll]] for (uint place = kPadding; place < kMerged - apart; ++place)             \
      if ((place & apart) == 0)                                                          \
        NEARER_FIRST(squares[place - kPadding], found[place - kPadding],                 \
                     squares[place - kPadding + apart], found[place - kPadding + apart]) \
  }

// Takes the leaf's seeds that are nearer than the farthest of the list into it: the nearest of both, ascending and then
// descending or the other way round, are sorted by Batcher's bitonic merge. It is for powers of two; places before the
// list stand for nearer seeds, which stay where they are.
void merge_leaf() {
  [[unroll]] for (uint k = 0; k < kTreeArity; ++k) {
    const uint at = kMost - 1 - k;
    const bool nearer = leaf_squares[k] < squares[at];
    left_out = min(left_out, nearer ? squares[at] : leaf_squares[k]);
    squares[at] = nearer ? leaf_squares[k] : squares[at];
    found[at] = nearer ? leaf_found[k] : found[at];
  }
  MERGE(64)
  MERGE(32)
  MERGE(16)
  MERGE(8)
  MERGE(4)
  MERGE(2)
  MERGE(1)
}

void see_leaf(uint leaf) {
  float nearest = kFarthest;
  [[unroll]] for (uint k = 0; k < kTreeArity; ++k) {
    const uint other = leaf * kTreeArity + k;
    leaf_squares[k] = kFarthest;
    leaf_found[k] = other;
    if (other < seed_count && other != own_slot) {
      const real3 d = difference(seed(other), own);
      met = met || d == real3(0.0);
      leaf_squares[k] = narrow_square(d);
    }
    nearest = min(nearest, leaf_squares[k]);
  }
  if (nearest >= squares[kMost - 1]) {
    left_out = min(left_out, nearest);
    return;
  }
  sort_leaf();
  merge_leaf();
}

void main() {
  own_slot = invocation();
  if (own_slot >= seed_count) return;
  own = seed(own_slot);
  [[unroll]] for (uint k = 0; k < kMost; ++k) {
    squares[k] = kFarthest;
    found[k] = kNone;
  }
  const vec3 at = vec3(own.high);
  // Twice as many seeds as a list has, around the own.
  const uint leaves = nodes_of(0), home = own_slot / kTreeArity, beside = (kMost + kTreeArity - 1) / kTreeArity;
  const uint begin = home > beside ? home - beside : 0, end = min(home + beside + 1, leaves);
  // One loop for both, as it is long once it is unrolled.
  uint leaf = begin, level = top_level, node = 0, opened = 0;
  bool more = true;
  [[dont_unroll]] while (more && opened < kOpened) {
    uint next = leaf;
    if (leaf < end) {
      ++leaf;
    } else {
      ++opened;
      next = kNone;
      if (box_distance(level, node, at) <= squares[kMost - 1]) {
        if (level > 0) {
          --level;
          node *= kTreeArity;
          continue;
        }
        if (node < begin || node >= end) next = node;
      }
      more = next_node(level, node);
    }
    if (next != kNone) see_leaf(next);
  }
  // Of seeds at the same distance all are listed or none, so that lists do not depend on the order of slots.
  const float farthest = squares[kMost - 1], bound = left_out <= farthest ? farthest : kFarthest;
  uint count = 0;
  [[unroll]] for (uint k = 0; k < kMost; ++k) count += squares[k] < bound ? 1 : 0;
  const uint first = own_slot * kMost;
  [[unroll]] for (uint k = 0; k < kMost; ++k)
    if (k < count) lists[first + k] = found[k];
  bool doubtful = false;
  [[unroll]] for (uint k = 1; k < kMost; ++k)
    if (k < count && in_doubt(squares[k - 1], squares[k])) doubtful = true;
  if (doubtful) {
    [[dont_unroll]] for (uint k = 1; k < count; ++k) {
      const uint other = lists[first + k];
      uint m = k;
      [[dont_unroll]] for (; m > 0; --m) {
        const uint before = lists[first + m - 1];
        if (!farther(before, other, own)) break;
        lists[first + m] = before;
      }
      lists[first + m] = other;
    }
  }
  const float limit = count < seed_count - 1 ? certain_square(farthest) : float(kInfinity);
  const bool complete = !more && loops_complete(two);
  list_info[own_slot] = uvec4(first, complete ? count : 0, floatBitsToUint(complete ? limit : 0.0), kListFirst);
  if (met) atomicAdd(counters[kCoincident], 1u);
}
