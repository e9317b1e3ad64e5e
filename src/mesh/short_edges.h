// Edges between points that are one but for rounding, collapsed.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

struct ShortEdges {
  std::vector<Index> vertex_of;       // of each vertex, the one that it has become, kNone if it went with its part
  std::size_t collapsed = 0;          // edges, each with one vertex
  std::size_t removed_parts = 0;      // closed, without an inside but for rounding
  std::size_t removed_triangles = 0;  // those that had one of these edges, or were of such a part
};

// Collapses edges shorter than `length`, the shortest first, where the surface stays of the same kind: the two ends
// have no neighbours in common but the corners opposite to the edge (the link condition of Dey, Edelsbrunner, Guha and
// Nekhayev 1999), and the edge is a border if both ends are on borders. Edges between labels, of more than two
// triangles, those `given` and the mesh's feature edges count as borders do; and no edge is collapsed by which a
// triangle would come to lie on another. The end on such a line stays, else that of the lower index; so
// vertices move by `length` at most, but for chains of such edges. Parts without any such line go whose bounding box
// has a diagonal shorter than `length`, or than `flat_part` if they are no farther than `length` from a plane, as what
// is left of a fold: they have no inside. But not all parts. Vertices and triangles keep their order; labels and
// face_of_triangle follow, feature_edges too.
ShortEdges collapse_short_edges(TriangleMesh& mesh, double length, const std::vector<std::array<Index, 2>>& given,
                                double flat_part = 0);

}  // namespace bisector
