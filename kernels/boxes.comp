#version 460
#extension GL_GOOGLE_include_directive : require
// One level of the tree of boxes over the seeds, from the seeds or from the level below.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(constant_id = 0) const bool kLeaves = true;

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) buffer Boxes { float boxes[]; };
#define PUSH_BOXES
#include "layout/push.h"
LOAD_POINT(seed, seed_words)

void main() {
  const uint node = invocation(), first = node * kTreeArity;
  if (first >= child_count) return;
  const uint end = min(first + kTreeArity, child_count);
  vec3 lower = vec3(3e38), upper = vec3(-3e38);
  [[dont_unroll]] for (uint k = first; k < end; ++k) {
    if (kLeaves) {
      const vec3 p = vec3(seed(first_child + k).high);
      lower = min(lower, p);
      upper = max(upper, p);
    } else {
      const uint at = kBoxWords * (first_child + k);
      lower = min(lower, vec3(boxes[at], boxes[at + 1], boxes[at + 2]));
      upper = max(upper, vec3(boxes[at + 3], boxes[at + 4], boxes[at + 5]));
    }
  }
  if (kLeaves) {
    precise vec3 least = lower - vague;
    precise vec3 most = upper + vague;
    lower = least;
    upper = most;
  }
  const uint at = kBoxWords * (first_node + node);
  for (int k = 0; k < 3; ++k) {
    boxes[at + k] = lower[k];
    boxes[at + 3 + k] = upper[k];
  }
}
