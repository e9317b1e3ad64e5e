#version 460
#extension GL_GOOGLE_include_directive : require
// Starts the cells that meet a solid's boundary at the tetrahedra beneath it, and marks them.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer ShellPairs { uvec2 shell_pairs[]; };     // of the boundary's facets
layout(std430, binding = 1) readonly buffer ShellStatus { uint shell_status[]; };
layout(std430, binding = 2) readonly buffer TetOfFacet { uint tet_of_facet[]; };
layout(std430, binding = 3) buffer CellErrors { uint cell_errors[]; };
layout(std430, binding = 4) writeonly buffer Proposals { uvec2 proposals[]; };
layout(std430, binding = 5) buffer Counters { uint counters[]; };
#define PUSH_START_BOUNDARY
#include "layout/push.h"
#include "layout/counters.h"

void main() {
  const uint index = invocation();
  if (index >= pair_count || shell_status[index] == kStatusEmpty) return;
  const uvec2 pair = shell_pairs[index];
  atomicOr(cell_errors[kCellErrorWords * cell_count + pair.y], kMarkBoundary);
  const uint at = atomicAdd(counters[kProposals], 1u);
  if (at < proposal_capacity) proposals[at] = uvec2(tet_of_facet[pair.x], pair.y);
  else atomicOr(counters[kOverflow], kOverflowProposals);
}
