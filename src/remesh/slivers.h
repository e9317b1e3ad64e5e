// Triangles that the edge lengths around them left no room to be good, or to keep apart.
#pragma once

#include "bisector/remesh.h"
#include "remesh/size_bounds.h"

namespace bisector {

struct Slivers {
  SizeBounds bounds;  // for better triangles in their places
  // More than a mesh has that anyone would call good, but so few that they are for the edge lengths.
  bool worth_another_run = false;
  bool hopeless = false;  // so many that they have other reasons
};

// Of a result with its feature edges. An angle that two feature edges enclose does not count: what is acute stays so.
Slivers find_slivers(const TriangleMesh& mesh);

// Where a result crosses itself: edges of half the length at the triangles that do.
struct Crossings {
  SizeBounds bounds;
  std::size_t pairs = 0;
};
Crossings find_crossings(const TriangleMesh& mesh);

struct JudgedResult {
  RemeshResult result;
  Slivers slivers;
  std::size_t crossings = 0;  // 0 as well if the input crosses itself
};
// With its slivers.
JudgedResult judge(RemeshResult result);

// Whether a run is to be preferred to another on the same input: for its topology, then for the curves it keeps, then
// for fewer pairs of triangles that cross though the input's do not, then for fewer slivers.
bool is_better(const JudgedResult& judged, const JudgedResult& than);
// Whether it is so by more than some slivers: by what comes before these, or by a third of them.
bool is_much_better(const JudgedResult& judged, const JudgedResult& than);
// Whether its topology is not the input's or more triangles cross, where the other is better in that.
bool is_worse(const JudgedResult& judged, const JudgedResult& than);

}  // namespace bisector
