#version 460
#extension GL_GOOGLE_include_directive : require
// Opens a batch of facets: one whose corners lie in one cell lies in it, for cells are convex; for others the owners of
// their corners are proposed.
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

const bool kNarrow = false;

layout(std430, binding = 0) readonly buffer Seeds { real seed_words[]; };
layout(std430, binding = 1) readonly buffer Facets { real facet_words[]; };
layout(std430, binding = 2) readonly buffer FacetMeta { uint facet_meta[]; };
layout(std430, binding = 3) readonly buffer Wholes { real whole_words[]; };  // moments of facets about their anchors
layout(std430, binding = 4) readonly buffer Owners { uint owners[]; };
layout(std430, binding = 5) writeonly buffer Pairs { uvec2 pairs[]; };
layout(std430, binding = 6) writeonly buffer Status { uint status_of[]; };
layout(std430, binding = 7) writeonly buffer MassSecond { uint mass_second[]; };
layout(std430, binding = 8) writeonly buffer First { uint first_moments[]; };
layout(std430, binding = 9) writeonly buffer Proposals { uvec2 proposals[]; };
layout(std430, binding = 10) buffer Counters { uint counters[]; };
#define PUSH_START_FACETS
#include "layout/push.h"
#include "layout/counters.h"
#include "facet.glsl"
LOAD_POINT(seed, seed_words)

#include "moments.glsl"
#include "moments_store.glsl"

// Twin of moved() in src/voronoi/moments.h: moments about the seed, `origin` being the anchor seen from there.
Moments moved(uint facet, real3 origin) {
  const uint at = kMomentWords * (facet - element_base);
  const real mass = whole_words[at];
  const real3 first = real3(whole_words[at + 1], whole_words[at + 2], whole_words[at + 3]);
  Moments m;
  precise real3 f = mass * origin + first;
  precise real s = mass * norm2(origin) + real(2.0) * dot3(origin, first) + whole_words[at + kSecondMomentAt];
  m.mass = mass;
  m.first = f;
  m.second = s;
  return m;
}

void main() {
  const uint index = invocation();
  if (index >= facet_count) return;
  const uint facet = first_facet + index;
  const uvec3 sites = facet_sites(facet);
  const uint a = owners[sites.x], b = owners[sites.y], c = owners[sites.z];
  if (a == b && a == c) {
    const uint pair = atomicAdd(counters[kPairs], 1u);
    if (pair >= pair_capacity) {
      atomicOr(counters[kOverflow], kOverflowPairs);
      return;
    }
    pairs[pair] = uvec2(facet, a);
    status_of[pair] = kStatusWhole;
    const uint bits = facet_meta[kFacetMetaWords * (facet - element_base) + kFacetBitsAt];
    const Point anchor = facet_point((facet - element_base) * kFacetWords + kPointWords * anchor_of(bits));
    store_moments(pair, moved(facet, difference(anchor, seed(a))));
    return;
  }
  const uint count = 1 + (b != a ? 1 : 0) + (c != a && c != b ? 1 : 0);
  uint at = atomicAdd(counters[kProposals], count);
  if (at + count > proposal_capacity) {
    atomicOr(counters[kOverflow], kOverflowProposals);
    return;
  }
  proposals[at++] = uvec2(facet, a);
  if (b != a) proposals[at++] = uvec2(facet, b);
  if (c != a && c != b) proposals[at] = uvec2(facet, c);
}
