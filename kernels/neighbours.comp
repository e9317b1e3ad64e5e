#version 460
#extension GL_GOOGLE_include_directive : require
// The nearest seeds of a seed in ascending distance, ties by the caller's index, and a certificate: whoever is not
// listed lies at `radius` or more. Rings of grid cells are searched outwards until the list is full and closed, or too
// much has been seen.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(constant_id = 0) const uint kMost = 32;       // entries of a list
layout(constant_id = 1) const bool kTargets = false;  // lists for some slots only, kept apart from the first ones
// Seeds that are looked at: few enough for loops to stay below llvmpipe's limit if eight invocations take turns.
layout(constant_id = 2) const uint kExamined = 512;

const int kRings = 5;

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Ids { uvec4 ids[]; };
layout(std430, binding = 2) readonly buffer Begins { uint bucket_end[]; };
layout(std430, binding = 3) readonly buffer Slots { uint bucket_slots[]; };
layout(std430, binding = 4) writeonly buffer Lists { uint lists[]; };
layout(std430, binding = 5) writeonly buffer Info { uvec4 list_info[]; };  // ListInfo
layout(std430, binding = 6) buffer Counters { uint counters[]; };
layout(std430, binding = 7) readonly buffer Targets { uint targets[]; };
#define PUSH_NEIGHBOURS
#include "layout/push.h"
#include "layout/counters.h"
#include "grid.glsl"
LOAD_POINT(seed, seed_words)

// The nearest seeds so far, as a heap with the farthest on top.
real squares[kMost];
uint found[kMost];

bool farther(real square_a, uint a, real square_b, uint b) {
  return square_a > square_b || (square_a == square_b && ids[a].x > ids[b].x);
}

// Puts a seed where `at` is free, in a heap of `size`.
void sift_down(uint at, uint size, real square, uint other) {
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

void sift_up(uint at, real square, uint other) {
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

void main() {
  const uint index = invocation();
  if (kTargets ? first_target + index >= min(counters[kWideTargets], target_capacity) : index >= seed_count) return;
  const uint slot = kTargets ? targets[first_target + index] : index;
  const Point x = seed(slot);
  const ivec3 home = cell_at(x);
  uint count = 0, seen = 0, examined = 0;
  real closed = real(0.0);  // everything nearer than this has been seen
  bool met = false;
  [[dont_unroll]] for (int ring = 0; ring <= kRings; ++ring) {
    [[dont_unroll]] for (int z = -ring; z <= ring; ++z)
      [[dont_unroll]] for (int y = -ring; y <= ring; ++y) {
        const bool face = abs(z) == ring || abs(y) == ring;
        [[dont_unroll]] for (int step = -ring; step <= ring; step += face || ring == 0 ? 1 : 2 * ring) {
          const ivec3 cell = home + ivec3(step, y, z);
          const uint bucket = bucket_of(cell);
          const uint end = bucket_end[bucket];
          [[dont_unroll]] for (uint k = bucket == 0 ? 0 : bucket_end[bucket - 1]; k < end && examined <= kExamined;
                               ++k) {
            ++examined;
            const uint other = bucket_slots[k];
            const Point p = seed(other);
            if (cell_at(p) != cell) continue;
            ++seen;
            if (other == slot) continue;
            const real squared = norm2(difference(p, x));
            if (squared == real(0.0)) met = true;
            if (count < kMost) sift_up(count++, squared, other);
            else if (farther(squares[0], found[0], squared, other)) sift_down(0, kMost, squared, other);
          }
        }
      }
    if (examined > kExamined) break;
    if (seen == seed_count) {
      closed = kInfinity;
      break;
    }
    const real reach = ring_distance(x, ring, residual);
    precise real reach_squared = reach * reach;
    closed = reach_squared;
    if (count == kMost && squares[0] < closed) break;
  }
  const real farthest = count == 0 ? real(0.0) : squares[0];
  [[dont_unroll]] for (uint size = count; size > 1; --size) {
    const real last_square = squares[size - 1];
    const uint last = found[size - 1];
    squares[size - 1] = squares[0];
    found[size - 1] = found[0];
    sift_down(0, size - 1, last_square, last);
  }
  // Distances were rounded; the certificate must hold all the same.
  precise real limit = closed;
  if (count == kMost) limit = min(limit, farthest);
  uint listed = 0;
  [[dont_unroll]] for (; listed < count && !(squares[listed] > limit); ++listed) {}
  if (!(limit == kInfinity)) {
    precise real error = real(64.0) * kUnit * limit + real(16.0) * real(residual) * sqrt(limit);
    limit = limit * real(0.99999) - error;
  }
  const uint first = (kTargets ? first_target + index : index) * kMost;
  [[dont_unroll]] for (uint k = 0; k < listed; ++k) lists[first + k] = found[k];
  const bool complete = loops_complete(two);
  list_info[slot] = uvec4(first | (kTargets ? kWideList : 0u), complete ? listed : 0,
                          floatBitsToUint(complete ? max(float(limit), 0.0) : 0.0), 0);
  if (met) atomicAdd(counters[kCoincident], 1u);
}
