// One vertex of one cell on one tetrahedron, and the sides of seeds on which it is held to lie, by the code that clips.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

const uint kMostPlanes = 8, kMostVertices = 8;
const uint kTested = 6;  // the cell's slot is followed by three that the planes may name, and by these

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Ids { uvec4 ids[]; };
layout(std430, binding = 2) readonly buffer Tets { real tet_words[]; };
layout(std430, binding = 3) readonly buffer TetMeta { uint tet_meta[]; };
layout(std430, binding = 4) readonly buffer Vertices { uvec4 vertices[]; };  // slot, three labels
layout(std430, binding = 5) writeonly buffer Sides { int sides[]; };         // +-1, 0: unsure
layout(std430, binding = 6) writeonly buffer Places { real places[]; };      // the vertex, its slack or -1
layout(push_constant) uniform Push {
  float residual;
  uint count;
};
#include "tet.glsl"
LOAD_POINT(seed, seed_words)

uint neighbour(uint k) { return kNone; }

#include "tet_clipper.glsl"

void main() {
  const uint index = invocation();
  if (index >= count) return;
  const uint slot = vertices[index].x;
  const uvec3 labels = vertices[index].yzw;
  begin_tet(index, slot);
  uvec3 on;
  uint facets = 0;
  for (uint e = 0; e < 3; ++e) {
    if ((labels[e] & kFacetLabel) != 0) {
      on[e] = labels[e] & 3u;
      ++facets;
      continue;
    }
    const real3 d = difference(seed(labels[e]), own);
    on[e] = plane_count++;
    set_seed_plane(on[e], labels[e], d, norm2(d));
  }
  uint v = 4;
  bool certain = true;
  if (facets == 3) {
    v = 6 - on.x - on.y - on.z;
  } else {
    vertex_on[v] = packed(on.x, on.y, on.z);
    certain = place_vertex(v);
  }
  for (uint t = 0; t < kTested; ++t) {
    const uint other = slot + 4 + t;
    const real3 d = difference(seed(other), own);
    sides[kTested * index + t] = certain ? side_of(v, d, norm2(d), other) : 0;
  }
  for (uint c = 0; c < 3; ++c) places[4 * index + c] = vertex_at[v][c];
  places[4 * index + 3] = certain ? vertex_slack[v] : real(-1.0);
}
