// Parts of a surface that come near to each other, moved apart while they are remeshed.
//
// A seed owns whatever is nearest to it, on all components of the surface. Where these touch, cross or lie in each
// other, cells hold pieces of several, the dual joins what is not joined, and no number of seeds helps where two of
// them coincide. But components have nothing to do with each other: the energy of each depends on its own seeds alone,
// if these own nothing else. So those that are near to each other are moved to different places, where one run
// remeshes all of them.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/remesh.h"
#include "core/geometry.h"

namespace bisector {

class SetApart {
 public:
  // Moves nothing.
  SetApart() = default;
  // Components, which hang together through vertices, are near to each other if their bounding boxes are not farther
  // apart than edges are long, `edge_length` being wanted at each vertex. Where there are more than an eighth of the
  // `vertices` wanted, as in a soup, nothing is moved: each takes at least four.
  SetApart(const TriangleMesh& mesh, const std::vector<double>& edge_length, std::size_t vertices);

  // Whether nothing is moved.
  bool empty() const { return offset_.empty(); }

  // Moves vertices of that mesh to the places of their components. There may be more of them behind, and other
  // triangles, if they are parts of those there were.
  void move(TriangleMesh& mesh) const;

  // Where a point near the surface was before it was moved. Points that were not moved stay.
  Vec3 back(const Vec3& p) const;

  // What a result of a mesh that was moved says of places and of percents of the diagonal, as of the mesh before.
  void report_back(RemeshResult& result) const;

  // Moves the result of a mesh that was moved back. `corners` are those of its features, as they were before.
  void move_back(const std::vector<Vec3>& corners, RemeshResult& result) const;

 private:
  Vec3 lo_, step_;            // corner and size of the box in which components that are not moved are
  std::vector<Vec3> offset_;  // of each component
  double longer_ = 1;         // by how much the diagonal of all of them is, when they are moved
};

}  // namespace bisector
