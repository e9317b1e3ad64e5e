// The same surface with fewer triangles: what lies flat, and edges that run straight on, need no vertices inside.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// Triangles of the vertices of a mesh, some of which are unused.
class PlanarReduction {
 public:
  // Collapses edges of the mesh's triangles, which have no repeated corners, where that leaves every point of the
  // surface where it is but for the rounding of coordinates to six digits. Vertices stay at corners, at ends of the
  // edges `kept`, and where folds, borders, non-manifold edges or edges between labels
  // turn or meet; also where a triangle has no normal, and where nothing but slivers would be left. A mesh divided into
  // smaller triangles becomes what it was. `labels` are of the triangles, or empty.
  PlanarReduction(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles,
                  const std::vector<std::int32_t>& labels, const std::vector<std::array<Index, 2>>& kept);

  std::vector<Triangle> triangles;
  std::vector<Index> origin;  // of each, the triangle of the mesh that it is left of, and has its label from

  // The vertices of the mesh along an edge where the surface folds or ends, from a to b.
  std::vector<Index> chain(Index a, Index b) const;

 private:
  class Work;
  using Chains = std::unordered_map<std::uint64_t, std::vector<Index>>;
  static std::vector<Index> chain_of(const Chains& chains, Index a, Index b);

  Chains chains_;  // inner vertices by both ends, from the lower
};

}  // namespace bisector
