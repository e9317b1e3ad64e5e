// Facets as host/passes/device_surface.cpp packs them (layout/elements.h), twins of Facet in src/voronoi/surface.h.
//
// To include: `facet_words`, `facet_meta` and `element_base`, the index of the first facet in these buffers.

#if BISECTOR_DOUBLE
const uint kNormalAt = kDoubleFacetNormalAt, kDensityAt = kDoubleFacetDensityAt, kGradientAt = kDoubleFacetGradientAt,
           kFacetWords = kDoubleFacetWords;
#else
const uint kNormalAt = kSingleFacetNormalAt, kEdgesAt = kSingleFacetEdgesAt, kDensityAt = kSingleFacetDensityAt,
           kGradientAt = kSingleFacetGradientAt, kFacetWords = kSingleFacetWords;
#endif

real3 facet_vector(uint at) { return real3(facet_words[at], facet_words[at + 1], facet_words[at + 2]); }

Point facet_point(uint at) {
  Point p;
  p.high = facet_vector(at);
#if !BISECTOR_DOUBLE
  p.low = facet_vector(at + 3);
#endif
  return p;
}

uint facet_triangle(uint facet) { return facet_meta[kFacetMetaWords * (facet - element_base) + kFacetTriangleAt]; }
uvec3 facet_sites(uint facet) {
  const uint at = kFacetMetaWords * (facet - element_base);
  return uvec3(facet_meta[at], facet_meta[at + 1], facet_meta[at + 2]);
}

uint anchor_of(uint bits) { return bits & 3u; }
uint origin_of(uint bits, uint edge) { return (bits >> (kOriginShift + 2 * edge)) & 3u; }
uint rank_of(uint bits, uint edge) { return (bits >> (kRankShift + 2 * edge)) & 3u; }
