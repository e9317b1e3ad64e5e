// Moves the vertices of a remeshed surface off the input, to where its triangles are nearest to it. A mesh with its
// vertices on the input lies inside where that is convex, and most of its distance is this bias.
#pragma once

#include <optional>
#include <vector>

#include "bisector/context.h"
#include "bisector/remesh.h"
#include "core/geometry.h"

namespace bisector {

struct FitOptions {
  // Nonzero: the vertex stays (corners, creases). One per vertex of the mesh, or empty for none. Vertices at borders
  // and non-manifold edges stay in any case.
  std::vector<char> fixed;
  int iterations = 10;      // at most
  double tolerance = 0.01;  // ends when a step takes less than this share off the squared distance
  // No triangle's smallest angle (degrees) or Q (mesh/quality.h) falls below these; one that is below at the start gets
  // no worse. Without a value: the smallest of the mesh at the start, which holds back much of a mesh that has many
  // triangles near its smallest.
  std::optional<double> min_angle, min_quality;
  double done = 0, share = 1;  // for progress: fraction of the whole run before the fit, and its own
};

// Minimises the two-sided mean squared distance between mesh and reference over the vertices, by alternation: fixed
// samples of either side find their nearest points on the other, then the vertices minimise the squared distances
// within these pairs, which bound the distance from above and equal it where the vertices are now (as in iterative
// closest points, Besl and McKay 1992, but with every vertex as an unknown). A weak pull within the tangent plane to
// where its triangles would be equilateral keeps each vertex from sliding for little gain. A step that would not lessen
// the distance is shortened, or ends the fit; it is shortened locally around triangles that would break a bound of
// `options` or turn over, and what would make triangles intersect that did not before is taken back. Pairs whose
// normals point away from each other, as those with the other sheet of a thin part, pull nowhere.
//
// Topology, order and triangles stay, and a mesh without area as a whole, as the dual of too few seeds may be. The
// result is the same for any number of threads. Throws Error if the reference has no area or `options.fixed` has
// another length, and Cancelled; the mesh is then as it was.
FitReport fit_to_surface(const TriangleMesh& reference, TriangleMesh& mesh, const FitOptions& options = {},
                         const Context& context = {});

}  // namespace bisector
