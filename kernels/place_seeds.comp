#version 460
#extension GL_GOOGLE_include_directive : require
// Puts the seeds, which come in the caller's order, into their slots, in the precisions that are needed.
#include "common.glsl"
#include "real.glsl"

layout(constant_id = 0) const bool kSplit = false;  // doubles are also made pairs of floats

layout(std430, binding = 0) readonly buffer Given { uint given[]; };    // by the caller's index
layout(std430, binding = 1) readonly buffer Order { uint order[]; };    // the caller's index of each slot
layout(std430, binding = 2) writeonly buffer Seeds { uint seed_words[]; };
layout(std430, binding = 3) writeonly buffer Doubles { uint double_words[]; };
layout(std430, binding = 4) writeonly buffer Ids { uvec4 ids[]; };      // SeedId
#define PUSH_COUNT
#include "layout/push.h"

void main() {
  const uint slot = invocation();
  if (slot >= count) return;
  const uint index = order[slot];
#if BISECTOR_DOUBLE
  uvec3 low = uvec3(0);
  for (uint k = 0; k < 3; ++k) {
    const uvec2 words = uvec2(given[kGivenDoubleWords * index + 2 * k], given[kGivenDoubleWords * index + 2 * k + 1]);
    if (kSplit) {
      double_words[kGivenDoubleWords * slot + 2 * k] = words.x;
      double_words[kGivenDoubleWords * slot + 2 * k + 1] = words.y;
      const double x = packDouble2x32(words);
      precise float high = float(x);
      precise double rest = x - double(high);
      seed_words[kSinglePointWords * slot + k] = floatBitsToUint(high);
      seed_words[kSinglePointWords * slot + 3 + k] = floatBitsToUint(float(rest));
      // Twin of low_word() in host/passes/packing.h: below 2^-100 floats may have lost the number.
      low[k] = x != 0.0LF && abs(x) < 7.8886090522101181e-31LF ? slot + 1 : words.x;
    } else {
      seed_words[kGivenDoubleWords * slot + 2 * k] = words.x;
      seed_words[kGivenDoubleWords * slot + 2 * k + 1] = words.y;
    }
  }
#else
  const uint at = kGivenSingleWords * index;
  for (uint k = 0; k < kSinglePointWords; ++k) seed_words[kSinglePointWords * slot + k] = given[at + k];
  const uvec3 low =
      uvec3(given[at + kSinglePointWords], given[at + kSinglePointWords + 1], given[at + kSinglePointWords + 2]);
#endif
  ids[slot] = uvec4(index, low);
}
