// Vertices put on edges of a triangle mesh, one after the other.
#pragma once

#include <span>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

class EdgeSplitter {
 public:
  // The mesh must outlive the object and is changed by nothing else. Its feature edges stay as they are.
  explicit EdgeSplitter(TriangleMesh& mesh);

  // The triangles at a vertex, in no order. Good until the next split.
  std::span<const Index> triangles_at(Index vertex) const { return at_[vertex]; }

  // Puts a vertex at a + t (b - a) on an edge, which divides its triangles in two: labels and face_of_triangle follow.
  // Returns the vertex.
  Index split(Index a, Index b, double t);

 private:
  TriangleMesh& mesh_;
  std::vector<std::vector<Index>> at_;
};

}  // namespace bisector
