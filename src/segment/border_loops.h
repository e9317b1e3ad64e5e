// Following the borders of labelled regions of triangles.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/region_borders.h"
#include "core/geometry.h"

namespace bisector {

// What is adjacent across the half-edges of triangles that are oriented alike.
struct HalfEdgeTwins {
  std::vector<std::size_t> twin;  // the other half-edge where there are two in opposite directions, or kNoTwin
  std::vector<char> is_single;    // the only half-edge of its edge
  std::vector<std::size_t> edge;  // that each half-edge lies on
  std::size_t edge_count = 0;
};
inline constexpr std::size_t kNoTwin = static_cast<std::size_t>(-1);
HalfEdgeTwins half_edge_twins(const std::vector<Triangle>& triangles, std::size_t vertex_count);

struct FollowedBorders {
  RegionBorders borders;  // without measures and triangles; loops are in the order of their first half-edge
  std::vector<std::vector<std::size_t>> half_edges;  // of each chain's edges, on its left
  HalfEdgeTwins twins;
};

// The loops of each region's border and their chains. Chains between two regions are of the kind `sharp`.
FollowedBorders follow_borders(const std::vector<Triangle>& triangles, std::size_t vertex_count,
                               const std::vector<Index>& labels, std::size_t region_count);

}  // namespace bisector
