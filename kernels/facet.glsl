// Facets as the host packs them (host/facets.cpp), twins of Facet in src/bisector/voronoi/surface.h.
//
// To include: `facet_words`, `facet_meta` and `facet_base`, the index of the first facet in these buffers.

#if BISECTOR_DOUBLE
const uint kFacetWords = 18;     // corners, normal, density, gradient
const uint kNormalAt = 9, kDensityAt = 12, kGradientAt = 15;
#else
const uint kFacetWords = 48;     // corners, normal, outward unit normals of the edges (all high and low), density, gradient
const uint kNormalAt = 18, kEdgesAt = 24, kDensityAt = 42, kGradientAt = 45;
#endif
const uint kMetaWords = 5;       // sites of the corners, triangle, bits

real3 facet_vector(uint at) { return real3(facet_words[at], facet_words[at + 1], facet_words[at + 2]); }

Point facet_point(uint at) {
  Point p;
  p.high = facet_vector(at);
#if !BISECTOR_DOUBLE
  p.low = facet_vector(at + 3);
#endif
  return p;
}

uint facet_triangle(uint facet) { return facet_meta[kMetaWords * (facet - facet_base) + 3]; }
uvec3 facet_sites(uint facet) {
  const uint at = kMetaWords * (facet - facet_base);
  return uvec3(facet_meta[at], facet_meta[at + 1], facet_meta[at + 2]);
}

// Bits: the anchor, then each edge's origin, then each edge's rank, two bits each.
uint anchor_of(uint bits) { return bits & 3u; }
uint origin_of(uint bits, uint edge) { return (bits >> (2 + 2 * edge)) & 3u; }
uint rank_of(uint bits, uint edge) { return (bits >> (8 + 2 * edge)) & 3u; }
