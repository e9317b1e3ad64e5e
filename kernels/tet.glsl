// Tetrahedra as the host packs them (host/device_solid.cpp).
//
// To include: `tet_words`, `tet_meta`.

#if BISECTOR_DOUBLE
const uint kNormalsAt = 12, kDensityAt = 24;
#else
const uint kNormalsAt = 24, kDensityAt = 48;
#endif
// Corners, outward unit normals of the facets (in single all high and low), density at the corners, its gradient, moments about the
// anchor.
const uint kGradientAt = kDensityAt + 4, kWholeAt = kDensityAt + 7, kTetWords = kDensityAt + 12;
const uint kTetMetaWords = 10;   // sites of the corners, what lies across the facets, bits, owner of all corners or none
const uint kAcrossAt = 4, kBitsAt = 8, kOwnerAt = 9;
const uint kFacetLabel = 0x80000000u;  // | k: the facet opposite corner k; else a label is a slot

const uint kIsBoundary = 1u, kIsMet = 2u;  // marks of cells

real3 tet_vector(uint at) { return real3(tet_words[at], tet_words[at + 1], tet_words[at + 2]); }

Point tet_point(uint at) {
  Point p;
  p.high = tet_vector(at);
#if !BISECTOR_DOUBLE
  p.low = tet_vector(at + 3);
#endif
  return p;
}
