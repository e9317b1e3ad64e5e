// Triangles that the edge lengths around them left no room to be good.
#pragma once

#include "bisector/remesh.h"
#include "remesh/prepare.h"

namespace bisector {

struct Slivers {
  SizeBounds bounds;  // for better triangles in their places
  // More than a mesh has that anyone would call good, but so few that they are for the edge lengths.
  bool worth_another_run = false;
};

// Of a result with its feature edges. An angle that two feature edges enclose does not count: what is acute stays so.
Slivers find_slivers(const TriangleMesh& mesh);

// Whether a run is to be preferred to another on the same input: for its topology, then for the curves it keeps, then
// for fewer slivers.
bool is_better(const RemeshResult& result, const RemeshResult& than);

}  // namespace bisector
