// Solids near to each other, moved apart while they are meshed (remesh/set_apart.h): sites of one would own parts of
// another, and what lies between them would count as a detail of both.
#pragma once

#include <vector>

#include "bisector/tetmesh.h"
#include "remesh/set_apart.h"

namespace bisector {

class SolidsApart {
 public:
  // Those that hang together through vertices stay together. Nothing is moved if seeds or edge lengths are given at
  // points.
  SolidsApart(const TetMesh& mesh, const TetOptions& options);

  bool empty() const { return apart_.empty(); }
  // The solids at their places.
  const TetMesh& mesh() const { return moved_; }
  // Vertices at those of the given mesh get their places back to the bit.
  void move_back(TetResult& result) const;

 private:
  SetApart apart_;
  TetMesh moved_;
  std::vector<Vec3> before_;  // vertices
};

}  // namespace bisector
