#version 460
#extension GL_GOOGLE_include_directive : require
// Opens a batch of tetrahedra: notes which lie in one cell, for cells are convex, and proposes the owners of the
// corners.
#include "common.glsl"

layout(std430, binding = 0) buffer TetMeta { uint tet_meta[]; };
layout(std430, binding = 1) readonly buffer Owners { uint owners[]; };
layout(std430, binding = 2) writeonly buffer Proposals { uvec2 proposals[]; };
layout(std430, binding = 3) buffer Counters { uint counters[]; };
#include "layout/elements.h"
#define PUSH_START_TETS
#include "layout/push.h"
#include "layout/counters.h"

void main() {
  const uint index = invocation();
  if (index >= tet_count) return;
  const uint tet = first_tet + index, meta = kTetMetaWords * tet;
  if (tet_meta[meta] == kNone) {  // of no volume, or the enclosure
    tet_meta[meta + kTetOwnerAt] = kNone;
    return;
  }
  uint found[4];
  uint count = 0;
  [[dont_unroll]] for (uint m = 0; m < 4; ++m) {
    const uint owner = owners[tet_meta[meta + m]];
    uint k = 0;
    [[dont_unroll]] while (k < count && found[k] != owner) ++k;
    if (k == count) found[count++] = owner;
  }
  tet_meta[meta + kTetOwnerAt] = count == 1 ? found[0] : kNone;
  const uint at = atomicAdd(counters[kProposals], count);
  if (at + count > proposal_capacity) {
    atomicOr(counters[kOverflow], kOverflowProposals);
    return;
  }
  [[dont_unroll]] for (uint k = 0; k < count; ++k) proposals[at + k] = uvec2(tet, found[k]);
}
