// Vertices and edges of the input that a result has to have as they are.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/features.h"
#include "bisector/remesh.h"
#include "remesh/size_bounds.h"

namespace bisector {

// Makes vertices of the mesh corners: curves through them are divided there, and those on no curve stand alone.
void add_corners(FeatureGraph& graph, const std::vector<Index>& vertices);

// The corners at both ends of an open curve, by their places among those of the graph.
std::array<std::size_t, 2> ends_of(const FeatureGraph& features, const FeatureCurve& curve);

// What of a prepared input is to be kept, by its features.
struct KeptFeatures {
  std::vector<Index> corners;  // of each corner, the vertex of the input that it is; kNone: it may be left out
  std::vector<char> curves;    // of each curve, whether it is an edge that must not be divided

  bool empty() const { return corners.empty(); }
};

// Gives the vertices of a result that are kept ones the bits of the input's, names them in RemeshResult::kept, and
// takes those out of the mesh that divide kept edges: edges are contracted along them, and the triangles around made
// Delaunay as far as that goes. Places, features and topology follow. Throws Error if a kept vertex or edge is not in
// the result.
void restore_kept(const KeptFeatures& kept, const FeatureGraph& features, const TriangleMesh& input,
                  RemeshResult& result);

// Takes the vertices out of the result, in the same way, that divide curves which are to be one edge: `whole` has a
// value for each. `surface` is what has been remeshed. Curves stay as they are where that does not go. Returns how long
// edges would be along these curves with the vertices that were taken out.
SizeBounds make_curves_whole(const std::vector<char>& whole, const FeatureGraph& features, const TriangleMesh& surface,
                             RemeshResult& result);

}  // namespace bisector
