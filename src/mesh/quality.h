// Triangle quality as the thesis reports it (section 4.5), and self-intersections.
#pragma once

#include <array>
#include <vector>

#include "core/geometry.h"
#include "mesh/topology.h"

namespace bisector {

struct QualityReport {
  double q_min = 0, q_ave = 0;           // Q = 6/sqrt(3) S/(p h): area, half-perimeter, longest edge; 1 is equilateral
  double theta_min = 0;                  // smallest angle, degrees
  double theta_min_ave = 0;              // mean over triangles of their smallest angle, degrees
  double theta_max = 0;                  // largest angle, degrees
  double theta_below_30 = 0;             // percent of triangles with an angle under 30 degrees
  // The same without what two of mesh.feature_edges impose on a triangle: its Q, and the angle between them.
  double q_min_free = 0, theta_min_free = 0, theta_max_free = 0;
  double valence6 = 0;                   // fraction of interior vertices with six neighbours
  double edge_min = 0, edge_ave = 0, edge_max = 0;  // lengths, in the mesh's unit
  double area = 0;
  std::size_t zero_area = 0;             // triangles without area: Q 0, angles 0 and 180, left out of the two means
  MeshTopology topology;
};

// All zeros if there are no triangles.
QualityReport measure_quality(const TriangleMesh& mesh);

// Pairs of triangles that intersect other than in a shared vertex or edge (exact predicates). Vertices at the same
// point count as one; triangles without area are ignored; two that fold onto each other at their edge do count.
std::size_t count_self_intersections(const TriangleMesh& mesh);

// The same pairs, lower index first, ascending.
std::vector<std::array<Index, 2>> find_self_intersections(const TriangleMesh& mesh);

}  // namespace bisector
