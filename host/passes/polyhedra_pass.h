// Polyhedra of a diagram that the device has found: labels from the device, coordinates by the CPU's formula from
// these, so that they are the CPU's bit for bit in either precision.
#pragma once

#include "host/passes/tet_pairs.h"
#include "voronoi/clipped.h"

namespace bisector::host {

class PolyhedraPass {
 public:
  explicit PolyhedraPass(Device& device) : labels_(device) {}

  // The polyhedra of all pairs in the store, in order of tetrahedra, then cells.
  void run(PairPass& pairs, const PairJob& job, TetPairs& domain, ExactRung& exact, ClippedPolyhedra& polyhedra);

 private:
  Buffer labels_;
};

}  // namespace bisector::host
