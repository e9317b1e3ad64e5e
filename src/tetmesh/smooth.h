// Smoothing of tetrahedral meshes, one vertex at a time: for the worst dihedral angle at the vertex (nonsmooth,
// Freitag and Ollivier-Gooch 1997) or for the radius ratios there.
#pragma once

#include <array>
#include <vector>

#include "tetmesh/slide.h"
#include "tetmesh/tet_edit.h"

namespace bisector {

class TetSmoother {
 public:
  TetSmoother(TetEdit& mesh, const TetSlide& slide);

  // Climbs the least dihedral_shape at the vertex until it is `enough` or cannot be raised. False if the vertex stays.
  bool raise_minimum(Index v, double enough);
  // One step of a vertex that is not held which raises the sum of the radius ratios at the vertex, or, where `steep`,
  // lowers that of their reciprocals. No dihedral_shape at the vertex falls below both the least there and `floor`.
  // False if the vertex stays.
  bool raise_ratios(Index v, double floor, bool steep);

 private:
  struct Star {
    std::vector<Index> tets;
    std::vector<std::array<Vec3, 3>> facets;  // opposite the vertex, so that (vertex, facet) is positive
    double size;                              // mean distance to their corners
  };
  bool gather(Index v);
  double minimum(const Vec3& x) const;
  double cost(const Vec3& x, bool steep) const;
  double cost(const Vec3& x, bool steep, Vec3& gradient) const;
  bool movable(Index v) const;
  // Where the vertex gets if it wants to be at x; false if it may not.
  bool admit(Index v, Vec3& x) const;

  TetEdit& mesh_;
  const TetSlide& slide_;
  std::vector<Vec3> first_;  // positions that normals are compared with
  Star star_;
};

}  // namespace bisector
