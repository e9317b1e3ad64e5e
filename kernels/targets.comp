#version 460
#extension GL_GOOGLE_include_directive : require
// Lists each cell once that needs a wider list and has none yet.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer Flagged { uint flagged[]; };
layout(std430, binding = 1) readonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 2) buffer Wide { uint wide[]; };  // per slot: 1 once it is listed
layout(std430, binding = 3) writeonly buffer Targets { uint targets[]; };
layout(std430, binding = 4) buffer Counters { uint counters[]; };
layout(push_constant) uniform Push {
  uint count;
  uint room;
};
#include "counters.glsl"

void main() {
  const uint index = invocation();
  if (index >= count) return;
  const uint slot = pairs[flagged[index]].y;
  if (atomicExchange(wide[slot], 1u) != 0) return;
  const uint at = atomicAdd(counters[kTargetCount], 1u);
  if (at < room) targets[at] = slot;
}
