#version 460
#extension GL_GOOGLE_include_directive : require
// Proposes the cells around sample points of large facets, so that the search from the corners need not cross them. A
// cell proposed in vain is found empty.
#include "common.glsl"

layout(std430, binding = 0) readonly buffer SampleFacets { uint sample_facets[]; };
layout(std430, binding = 1) readonly buffer Owners { uint owners[]; };
layout(std430, binding = 2) writeonly buffer Proposals { uvec2 proposals[]; };
layout(std430, binding = 3) buffer Counters { uint counters[]; };
layout(std430, binding = 4) readonly buffer SiteOwners { uint site_owners[]; };
layout(std430, binding = 5) readonly buffer FacetMeta { uint facet_meta[]; };
#include "layout/elements.h"
#define PUSH_START_SAMPLES
#include "layout/push.h"
#include "layout/counters.h"

void main() {
  const uint index = invocation();
  if (index >= sample_count) return;
  const uint owner = owners[first_sample + index];
  if (owner == kNone) return;
  const uint meta = kFacetMetaWords * (sample_facets[first_sample + index] - element_base);
  const uint a = site_owners[facet_meta[meta]], b = site_owners[facet_meta[meta + 1]],
             c = site_owners[facet_meta[meta + 2]];
  if (a == b && a == c) return;  // start_facets.comp has made a pair of the whole facet
  const uint at = atomicAdd(counters[kProposals], 1u);
  if (at < proposal_capacity) proposals[at] = uvec2(sample_facets[first_sample + index], owner);
  else atomicOr(counters[kOverflow], kOverflowProposals);
}
