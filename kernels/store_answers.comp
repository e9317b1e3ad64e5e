#version 460
#extension GL_GOOGLE_include_directive : require
// Stores what exact arithmetic on the CPU found for pairs.
#include "common.glsl"
#include "real.glsl"

const bool kNarrow = false;

layout(std430, binding = 0) readonly buffer Answers { uint answers[]; };
layout(std430, binding = 1) readonly buffer Values { real values[]; };    // mass, first, second
layout(std430, binding = 2) writeonly buffer Status { uint status_of[]; };
layout(std430, binding = 3) writeonly buffer MassSecond { uint mass_second[]; };
layout(std430, binding = 4) writeonly buffer First { uint first_moments[]; };
#define PUSH_COUNT
#include "layout/push.h"

#include "moments.glsl"
#include "moments_store.glsl"

void main() {
  const uint index = invocation();
  if (index >= count) return;
  const uint pair = answers[kAnswerWords * index];
  status_of[pair] = answers[kAnswerWords * index + 1];
  Moments m;
  m.mass = values[kMomentWords * index];
  m.first = real3(values[kMomentWords * index + 1], values[kMomentWords * index + 2], values[kMomentWords * index + 3]);
  m.second = values[kMomentWords * index + kSecondMomentAt];
  store_moments(pair, m);
}
