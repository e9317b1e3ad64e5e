// What every kernel shares: the shape of a workgroup and the names of special values.
#extension GL_EXT_control_flow_attributes : require
#include "layout/pairs.h"
#include "layout/sizes.h"

layout(local_size_x = kGroupSize) in;

const uint kNone = LAYOUT_NONE;
const uint kEdgeLabel = LAYOUT_BORDER_LABEL;  // | k: the facet's edge k; else a label is a slot

// Workgroups are laid out in x and y.
uint invocation() {
  return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
}

// Whether all loops so far ran to their ends. Mesa's llvmpipe ends every loop of an invocation after its first pass
// once they have run 65535 times in all. `two` must be 2, and unknown to the compiler.
bool loops_complete(uint two) {
  uint passes = 0;
  [[dont_unroll]] for (uint k = 0; k < two; ++k) passes += two - k;
  return passes == 3;
}
