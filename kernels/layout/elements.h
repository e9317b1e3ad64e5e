// Facets and tetrahedra as they lie in buffers. A point is three doubles, or in single precision three high and three
// low floats; a vector is three words in either. Places are in words of one real within an element.
#ifndef BISECTOR_KERNELS_LAYOUT_ELEMENTS_H
#define BISECTOR_KERNELS_LAYOUT_ELEMENTS_H

#include "types.h"

LAYOUT_BEGIN

LAYOUT_CONSTANT uint kSinglePointWords = 6;
LAYOUT_CONSTANT uint kDoublePointWords = 3;

// Seeds as the host gives them, in words of 32 bits: three doubles; or a point in single precision and the low words of
// its coordinates as doubles.
LAYOUT_CONSTANT uint kGivenDoubleWords = 6;
LAYOUT_CONSTANT uint kGivenSingleWords = 9;

// A facet: three corners (points), normal (point), in single precision the outward unit normals of the edges within the
// facet's plane (points), densities at the corners, gradient of the density (vector).
LAYOUT_CONSTANT uint kSingleFacetNormalAt = 18;
LAYOUT_CONSTANT uint kSingleFacetEdgesAt = 24;
LAYOUT_CONSTANT uint kSingleFacetDensityAt = 42;
LAYOUT_CONSTANT uint kSingleFacetGradientAt = 45;
LAYOUT_CONSTANT uint kSingleFacetWords = 48;
LAYOUT_CONSTANT uint kDoubleFacetNormalAt = 9;
LAYOUT_CONSTANT uint kDoubleFacetDensityAt = 12;
LAYOUT_CONSTANT uint kDoubleFacetGradientAt = 15;
LAYOUT_CONSTANT uint kDoubleFacetWords = 18;

// Whole numbers of a facet: sites of the corners, triangle, bits: of two bits each the anchor, the edges' origins,
// their ranks.
LAYOUT_CONSTANT uint kFacetMetaWords = 5;
LAYOUT_CONSTANT uint kFacetTriangleAt = 3;
LAYOUT_CONSTANT uint kFacetBitsAt = 4;
LAYOUT_CONSTANT uint kOriginShift = 2;
LAYOUT_CONSTANT uint kRankShift = 8;

// A tetrahedron: four corners (points), outward unit normals of the facets (points), densities at the corners, gradient
// of the density (vector), moments about the anchor.
LAYOUT_CONSTANT uint kSingleTetNormalsAt = 24;
LAYOUT_CONSTANT uint kSingleTetDensityAt = 48;
LAYOUT_CONSTANT uint kDoubleTetNormalsAt = 12;
LAYOUT_CONSTANT uint kDoubleTetDensityAt = 24;
LAYOUT_CONSTANT uint kTetGradientAfterDensity = 4;
LAYOUT_CONSTANT uint kTetMomentsAfterDensity = 7;
LAYOUT_CONSTANT uint kTetWordsAfterDensity = 12;

// Whole numbers of a tetrahedron: sites of the corners (none if it has no volume or is the enclosure); bits: of two
// bits each the corners in order and the facets' anchors; the cell that owns all corners, or none.
LAYOUT_CONSTANT uint kTetMetaWords = 6;
LAYOUT_CONSTANT uint kTetBitsAt = 4;
LAYOUT_CONSTANT uint kTetOwnerAt = 5;
LAYOUT_CONSTANT uint kTetAnchorShift = 8;

LAYOUT_END

#ifdef __cplusplus
namespace bisector::host {

struct FacetMeta {
  std::array<uint, 3> sites;
  uint triangle, bits;
};
struct TetMeta {
  std::array<uint, 4> sites;
  uint bits, owner;
};
static_assert(sizeof(FacetMeta) == kFacetMetaWords * sizeof(uint));
static_assert(offsetof(FacetMeta, triangle) == kFacetTriangleAt * sizeof(uint));
static_assert(offsetof(FacetMeta, bits) == kFacetBitsAt * sizeof(uint));
static_assert(sizeof(TetMeta) == kTetMetaWords * sizeof(uint));
static_assert(offsetof(TetMeta, bits) == kTetBitsAt * sizeof(uint));
static_assert(offsetof(TetMeta, owner) == kTetOwnerAt * sizeof(uint));

// The places above, by precision.
struct FacetLayout {
  std::size_t normal, edges, density, gradient, words;
};
struct TetLayout {
  std::size_t normals, density, gradient, moments, words;
};
constexpr FacetLayout facet_layout(bool is_double) {
  if (is_double) return {kDoubleFacetNormalAt, 0, kDoubleFacetDensityAt, kDoubleFacetGradientAt, kDoubleFacetWords};
  return {kSingleFacetNormalAt, kSingleFacetEdgesAt, kSingleFacetDensityAt, kSingleFacetGradientAt, kSingleFacetWords};
}
constexpr TetLayout tet_layout(bool is_double) {
  const std::size_t density = is_double ? kDoubleTetDensityAt : kSingleTetDensityAt;
  return {is_double ? kDoubleTetNormalsAt : kSingleTetNormalsAt, density, density + kTetGradientAfterDensity,
          density + kTetMomentsAfterDensity, density + kTetWordsAfterDensity};
}
constexpr std::size_t point_words(bool is_double) { return is_double ? kDoublePointWords : kSinglePointWords; }

}  // namespace bisector::host
#endif
#endif
