// Tetrahedra as host/passes/device_solid.cpp packs them (layout/elements.h).
//
// To include: `tet_words`, `tet_meta`.

#if BISECTOR_DOUBLE
const uint kNormalsAt = kDoubleTetNormalsAt, kDensityAt = kDoubleTetDensityAt;
#else
const uint kNormalsAt = kSingleTetNormalsAt, kDensityAt = kSingleTetDensityAt;
#endif
const uint kGradientAt = kDensityAt + kTetGradientAfterDensity, kWholeAt = kDensityAt + kTetMomentsAfterDensity,
           kTetWords = kDensityAt + kTetWordsAfterDensity;
const uint kFacetLabel = LAYOUT_BORDER_LABEL;  // | k: the facet opposite corner k; else a label is a slot

real3 tet_vector(uint at) { return real3(tet_words[at], tet_words[at + 1], tet_words[at + 2]); }

Point tet_point(uint at) {
  Point p;
  p.high = tet_vector(at);
#if !BISECTOR_DOUBLE
  p.low = tet_vector(at + 3);
#endif
  return p;
}
