#version 460
#extension GL_GOOGLE_include_directive : require
// The nearest seeds of a seed in ascending distance, and a certificate: whoever is not listed lies at `radius` or more.
// Seeds near in the order of slots come first, so that few boxes of the tree are left to open. Distances are compared
// in single precision, and equal ones by the caller's index; those that this may have in the wrong order are sorted
// anew.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(constant_id = 0) const uint kMost = 32;       // entries of a list
layout(constant_id = 1) const bool kTargets = false;  // lists for some slots only, kept apart from the first ones
layout(constant_id = 2) const uint kOpened = 4096;    // boxes that are looked at

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Ids { uvec4 ids[]; };
layout(std430, binding = 2) readonly buffer Boxes { float boxes[]; };
layout(std430, binding = 3) writeonly buffer Lists { uint lists[]; };
layout(std430, binding = 4) writeonly buffer Info { uvec4 list_info[]; };  // ListInfo
layout(std430, binding = 5) buffer Counters { uint counters[]; };
layout(std430, binding = 6) readonly buffer Targets { uint targets[]; };
#define PUSH_NEIGHBOURS
#include "layout/push.h"
#include "layout/counters.h"
#include "seed_tree.glsl"
LOAD_POINT(seed, seed_words)

// The nearest seeds so far, as a heap with the farthest on top.
float squares[kMost];
uint found[kMost];
uint found_count = 0;

uint own_slot;
Point own;
bool met = false;  // a seed that this precision cannot tell apart from the own

bool farther(float square_a, uint a, float square_b, uint b) {
  return square_a > square_b || (square_a == square_b && ids[a].x > ids[b].x);
}

// Puts a seed where `at` is free, in a heap of `size`.
void sift_down(uint at, uint size, float square, uint other) {
  [[dont_unroll]] while (2 * at + 1 < size) {
    uint child = 2 * at + 1;
    if (child + 1 < size && farther(squares[child + 1], found[child + 1], squares[child], found[child])) ++child;
    if (!farther(squares[child], found[child], square, other)) break;
    squares[at] = squares[child];
    found[at] = found[child];
    at = child;
  }
  squares[at] = square;
  found[at] = other;
}

void sift_up(uint at, float square, uint other) {
  [[dont_unroll]] while (at > 0) {
    const uint parent = (at - 1) / 2;
    if (!farther(square, other, squares[parent], found[parent])) break;
    squares[at] = squares[parent];
    found[at] = found[parent];
    at = parent;
  }
  squares[at] = square;
  found[at] = other;
}

void see_leaf(uint leaf) {
  const uint end = min((leaf + 1) * kTreeArity, seed_count);
  [[dont_unroll]] for (uint other = leaf * kTreeArity; other < end; ++other) {
    if (other == own_slot) continue;
    const real3 d = difference(seed(other), own);
    if (d == real3(0.0)) met = true;
    const vec3 narrow = vec3(d);
    precise float squared = narrow.x * narrow.x + narrow.y * narrow.y + narrow.z * narrow.z;
    if (found_count < kMost) sift_up(found_count++, squared, other);
    else if (farther(squares[0], found[0], squared, other)) sift_down(0, kMost, squared, other);
  }
}

void main() {
  const uint index = invocation();
  const uint first_target = kTargets ? counters[kWideTargets + kBeginAfter] : 0;
  if (kTargets ? first_target + index >= counters[kWideTargets + kEndAfter] : index >= seed_count) return;
  own_slot = kTargets ? targets[first_target + index] : index;
  own = seed(own_slot);
  const vec3 at = vec3(own.high);
  // Twice as many seeds as a list has, around the own.
  const uint leaves = nodes_of(0), home = own_slot / kTreeArity, beside = (kMost + kTreeArity - 1) / kTreeArity;
  const uint begin = home > beside ? home - beside : 0, end = min(home + beside + 1, leaves);
  [[dont_unroll]] for (uint leaf = begin; leaf < end; ++leaf) see_leaf(leaf);
  uint level = top_level, node = 0, opened = 0;
  bool more = true;
  [[dont_unroll]] while (more && opened < kOpened) {
    ++opened;
    if (found_count < kMost || box_distance(level, node, at) <= squares[0]) {
      if (level > 0) {
        --level;
        node *= kTreeArity;
        continue;
      }
      if (node < begin || node >= end) see_leaf(node);
    }
    more = next_node(level, node);
  }
  const float farthest = found_count == 0 ? 0.0 : squares[0];
  [[dont_unroll]] for (uint size = found_count; size > 1; --size) {
    const float last_square = squares[size - 1];
    const uint last = found[size - 1];
    squares[size - 1] = squares[0];
    found[size - 1] = found[0];
    sift_down(0, size - 1, last_square, last);
  }
  [[dont_unroll]] for (uint k = 1; k < found_count; ++k) {
    precise float doubtful = squares[k - 1] * 1.00001;
    if (squares[k] > doubtful) continue;
    const uint other = found[k];
    const real squared = norm2(difference(seed(other), own));
    uint m = k;
    [[dont_unroll]] for (; m > 0; --m) {
      const uint before = found[m - 1];
      const real squared_before = norm2(difference(seed(before), own));
      if (squared_before < squared || (squared_before == squared && ids[before].x < ids[other].x)) break;
      found[m] = before;
    }
    found[m] = other;
  }
  // Distances were rounded; the certificate must hold all the same.
  float limit = float(kInfinity);
  if (found_count < seed_count - 1) {
    precise float error = 64.0 * 1.1920929e-7 * farthest + 16.0 * residual * sqrt(farthest);
    precise float certain = farthest * 0.99999 - error;
    limit = max(certain, 0.0);
  }
  const uint first = (kTargets ? first_target + index : index) * kMost;
  [[dont_unroll]] for (uint k = 0; k < found_count; ++k) lists[first + k] = found[k];
  const bool complete = !more && loops_complete(two);
  list_info[own_slot] = uvec4(first | (kTargets ? kWideList : 0u), complete ? found_count : 0,
                              floatBitsToUint(complete ? limit : 0.0), 0);
  if (met) atomicAdd(counters[kCoincident], 1u);
}
