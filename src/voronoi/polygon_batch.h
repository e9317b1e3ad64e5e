// Polygons with the same number of corners, side by side, for KnownPolygons.
#pragma once

#include <cstddef>

namespace bisector {

struct PolygonBatch {
  static constexpr std::size_t kLanes = 8, kMost = 9;  // corners
  using Row = double[kLanes];

  std::size_t corners = 0;
  // Of the facet.
  alignas(64) Row corner[3][3];
  Row normal[3], anchor;  // which of the corners
  Row runs_on[3];         // of each edge: 1 if its line runs from its own corner, else 0
  Row density[3], gradient[3];
  // The seed; of each corner of the polygon, the line of the edge that starts there: the facet's edge, or -1 and the
  // other seed.
  Row seed[3];
  Row edge[kMost], other[kMost][3];
  // Results: vertices relative to the seed, their squared lengths, bounds of the errors of their coordinates, 1 where
  // all are certain to lie within the facet; moments.
  Row at[kMost][3], squared[kMost], slack[kMost], fits;
  Row mass, first[3], second;
};

}  // namespace bisector
