// One corner of one cell on one facet, and the sides of seeds on which it is held to lie, by the code that clips.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

const uint kMostCorners = 4;
const uint kTested = 8;  // the cell's slot is followed by two that the labels may name, and by these

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Ids { uvec4 ids[]; };
layout(std430, binding = 2) readonly buffer Facets { real facet_words[]; };
layout(std430, binding = 3) readonly buffer FacetMeta { uint facet_meta[]; };
layout(std430, binding = 4) readonly buffer Corners { uvec4 corners[]; };  // facet, slot, label before, label after
layout(std430, binding = 5) writeonly buffer Sides { int sides[]; };       // +-1: by the bounds, +-2: a tie, 0: unsure
layout(std430, binding = 6) writeonly buffer Places { real places[]; };  // the corner, its slack or -1
layout(push_constant) uniform Push {
  uint element_base;
  float residual;
  uint count;
};
#include "facet.glsl"
LOAD_POINT(seed, seed_words)

uint neighbour(uint k) { return kNone; }

#include "clipper.glsl"

void main() {
  const uint index = invocation();
  if (index >= count) return;
  const uint slot = corners[index].y, before = corners[index].z, after = corners[index].w;
  begin_facet(corners[index].x, slot);
  uint k = 3;
  bool certain = true;
  if ((before & after & kEdgeLabel) != 0) k = after & 3u;
  else certain = meet(line_of(before), before, line_of(after), after, 3);
  for (uint t = 0; t < kTested; ++t) {
    const uint other = slot + 3 + t;
    const real3 d = difference(seed(other), own);
    int side = certain ? side_of(k, d, norm2(d)) : 0;
    if (certain && side == 0) side = 2 * tie_side(before, after, other);
    sides[kTested * index + t] = side;
  }
  for (uint c = 0; c < 3; ++c) places[4 * index + c] = corner_at[k][c];
  places[4 * index + 3] = certain ? corner_slack[k] : real(-1.0);
}
