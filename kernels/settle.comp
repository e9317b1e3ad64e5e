#version 460
#extension GL_GOOGLE_include_directive : require
// Takes over what the CPU found for pairs.
#include "common.glsl"
#include "real.glsl"

const bool kNarrow = false;

layout(std430, binding = 0) readonly buffer Settled { uint settled[]; };  // pair, status
layout(std430, binding = 1) readonly buffer Values { real values[]; };    // mass, first, second
layout(std430, binding = 2) writeonly buffer Status { uint status_of[]; };
layout(std430, binding = 3) writeonly buffer MassSecond { uint mass_second[]; };
layout(std430, binding = 4) writeonly buffer First { uint first_moments[]; };
layout(push_constant) uniform Push { uint count; };

struct Moments {
  real mass;
  real3 first;
  real second;
};
#include "moments_store.glsl"

void main() {
  const uint index = invocation();
  if (index >= count) return;
  const uint pair = settled[2 * index];
  status_of[pair] = settled[2 * index + 1];
  Moments m;
  m.mass = values[5 * index];
  m.first = real3(values[5 * index + 1], values[5 * index + 2], values[5 * index + 3]);
  m.second = values[5 * index + 4];
  store_moments(pair, m);
}
