// What every kernel shares: the shape of a workgroup and the names of special values.
#extension GL_EXT_control_flow_attributes : require
#include "layout/pairs.h"
#include "layout/sizes.h"

layout(local_size_x = kGroupSize) in;

const uint kNone = LAYOUT_NONE;
const uint kEdgeLabel = LAYOUT_BORDER_LABEL;  // | k: the facet's edge k; else a label is a slot

// 1, or in tests another odd number, by which lanes are mixed; workgroups then go backwards.
layout(constant_id = kOrderConstant) const uint kOrder = 1;

// Workgroups are laid out in x and y.
uint workgroup() {
  const uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  return kOrder == 1 ? group : gl_NumWorkGroups.y * gl_NumWorkGroups.x - 1 - group;
}

uint lane_of_workgroup() {
  return kOrder == 1 ? gl_LocalInvocationID.x : gl_LocalInvocationID.x * kOrder % gl_WorkGroupSize.x;
}

uint invocation() { return workgroup() * gl_WorkGroupSize.x + lane_of_workgroup(); }

// Whether all loops so far ran to their ends. Mesa's llvmpipe ends every loop of an invocation after its first pass
// once they have run 65535 times in all. `two` must be 2, and unknown to the compiler.
bool loops_complete(uint two) {
  uint passes = 0;
  [[dont_unroll]] for (uint k = 0; k < two; ++k) passes += two - k;
  return passes == 3;
}
