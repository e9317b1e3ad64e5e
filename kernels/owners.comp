#version 460
#extension GL_GOOGLE_include_directive : require
// The seed nearest to each point, if that is certain. The last owner bounds the search.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

const uint kOpened = 4096;  // boxes that are looked at

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Boxes { float boxes[]; };
layout(std430, binding = 2) readonly buffer Points { real point_words[]; };
layout(std430, binding = 3) buffer Owners { uint owners[]; };  // in: guesses; out: slots; kNone: unknown
layout(std430, binding = 4) buffer Counters { uint counters[]; };
layout(std430, binding = 5) writeonly buffer Uncertain { uint uncertain[]; };
#define PUSH_OWNERS
#include "layout/push.h"
#include "layout/counters.h"
#include "seed_tree.glsl"
LOAD_POINT(seed, seed_words)
LOAD_POINT(point, point_words)

Point own;
uint best = kNone;
real nearest = kInfinity, second = kInfinity;  // squared distances
float limit = 3e38;  // squared; boxes farther away hold nothing that matters

real error_at(real squared) {
  precise real error = real(32.0) * kUnit * squared + real(16.0) * real(residual) * sqrt(squared);
  return error;
}

void see(uint other) {
  const real squared = norm2(difference(own, seed(other)));
  if (squared < nearest) {
    second = nearest;
    nearest = squared;
    best = other;
    precise real far = nearest + real(4.0) * error_at(nearest);
    precise float rounded = float(far) * 1.00001 + 1e-30;
    limit = rounded;
  } else {
    second = min(second, squared);
  }
}

void main() {
  const uint i = invocation();
  if (i >= point_count) return;
  own = point(i);
  const vec3 at = vec3(own.high);
  // The leaf of the guess, or the one where the nearest is likely to be, is seen first.
  const uint guess = owners[i];
  const uint home = guess < seed_count ? guess / kTreeArity : likely_leaf(at);
  const uint end_of_home = min((home + 1) * kTreeArity, seed_count);
  [[dont_unroll]] for (uint other = home * kTreeArity; other < end_of_home; ++other) see(other);
  uint level = top_level, node = 0, opened = 0;
  bool more = true, left_out = false;
  [[dont_unroll]] while (more && opened < kOpened) {
    ++opened;
    if (box_distance(level, node, at) > limit) {
      left_out = true;
    } else {
      if (level > 0) {
        --level;
        node *= kTreeArity;
        continue;
      }
      if (node != home) {
        const uint end = min((node + 1) * kTreeArity, seed_count);
        [[dont_unroll]] for (uint other = node * kTreeArity; other < end; ++other) see(other);
      }
    }
    more = next_node(level, node);
  }
  if (left_out) second = min(second, real(limit));
  precise real apart = nearest + error_at(second);
  const bool certain =
      loops_complete(two) && !more && best != kNone && (second == kInfinity || apart < second);
  owners[i] = certain ? best : kNone;
  if (!certain && report_uncertain != 0) uncertain[atomicAdd(counters[kUncertainOwners], 1u)] = i;
}
