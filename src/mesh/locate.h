// Which tetrahedron a point lies in.
#pragma once

#include <array>
#include <vector>

#include "core/geometry.h"

namespace bisector {

class TetLocator {
 public:
  // The mesh, which must outlive the object, has tetrahedra.
  explicit TetLocator(const TetMesh& mesh);

  // The tetrahedron that holds p, or one that p is just outside of, as rounding goes; far from all of them, one nearby.
  Index nearest(const Vec3& p) const;
  // Barycentric coordinates of p; a negative one if it is outside.
  std::array<double, 4> weights(Index tet, const Vec3& p) const;

 private:
  std::array<int, 3> cell_of(const Vec3& p) const;

  const TetMesh& mesh_;
  Box box_;
  double width_ = 1;         // of the grid's cells
  std::array<int, 3> size_;  // cells per direction
  Csr<Index> tets_;          // whose boxes meet a cell
};

}  // namespace bisector
