#version 460
#extension GL_GOOGLE_include_directive : require
// The seed nearest to each point, if that is certain. The last owner bounds the search.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

const int kRings = 5;
const uint kExamined = 2048;

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Ends { uint bucket_end[]; };
layout(std430, binding = 2) readonly buffer Slots { uint bucket_slots[]; };
layout(std430, binding = 3) readonly buffer Points { real point_words[]; };
layout(std430, binding = 4) buffer Owners { uint owners[]; };  // in: guesses; out: slots; kNone: unknown
layout(std430, binding = 5) buffer Counters { uint counters[]; };
layout(std430, binding = 6) writeonly buffer Uncertain { uint uncertain[]; };
#define PUSH_OWNERS
#include "layout/push.h"
#include "layout/counters.h"
#include "grid.glsl"
LOAD_POINT(seed, seed_words)
LOAD_POINT(point, point_words)

void main() {
  const uint i = invocation();
  if (i >= point_count) return;
  const Point q = point(i);
  const ivec3 home = cell_at(q);
  const uint guess = owners[i];
  uint best = kNone;
  real nearest = kInfinity, second = kInfinity;
  if (guess < seed_count) {
    best = guess;
    nearest = norm2(difference(q, seed(guess)));
  }
  bool closed = false;
  uint seen = 0, examined = 0;
  [[dont_unroll]] for (int ring = 0; ring <= kRings && !closed; ++ring) {
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
            if (other == guess) continue;
            const real squared = norm2(difference(q, p));
            if (squared < nearest) {
              second = nearest;
              nearest = squared;
              best = other;
            } else {
              second = min(second, squared);
            }
          }
        }
      }
    if (examined > kExamined) break;
    const real reach = ring_distance(q, ring, residual);
    precise real reach_squared = reach * (reach * real(0.999) - real(16.0) * real(residual));
    closed = seen == seed_count || reach_squared > nearest;
  }
  precise real error = real(32.0) * kUnit * second + real(16.0) * real(residual) * sqrt(second);
  const bool certain =
      loops_complete(two) && closed && best != kNone && (second == kInfinity || nearest + error < second);
  owners[i] = certain ? best : kNone;
  if (!certain && report_uncertain != 0) uncertain[atomicAdd(counters[kUncertainOwners], 1u)] = i;
}
