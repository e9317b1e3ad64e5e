// Tetrahedra with a node on each edge, whose faces follow a curved surface.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/context.h"
#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

// The nodes on the edges of a mesh of tetrahedra: each edge is the parabola through its ends and, half way in its
// parameter, its node. A tetrahedron is the quadratic image of one with straight edges.
struct SecondOrder {
  std::vector<std::array<Index, 2>> edges;  // of tetrahedra, lower vertex first, ascending
  std::vector<Vec3> nodes;                  // of each

  bool empty() const { return edges.empty(); }
  // The node of an edge, either vertex first; kNone if it is none of these.
  BISECTOR_API Index node_of(Index a, Index b) const;
};

// All lengths are in the mesh's unit.
struct SecondOrderReport {
  std::size_t boundary_nodes = 0;
  std::size_t curved = 0;  // of these, off the middle of their edge
  // On the boundary, less far from it than the surface, or not off it at all: an element would have turned over.
  std::size_t held_back = 0;
  // From the surface: of the nodes on the boundary, and of the middles of its edges.
  double node_distance_mean = 0, node_distance_max = 0, middle_distance_mean = 0, middle_distance_max = 0;
  // The least share that the Jacobian's determinant, bounded from below, has anywhere of that of the tetrahedron with
  // straight edges; of all tetrahedra with a volume.
  double jacobian_min = 1;
};

// Nodes for the edges of a mesh whose boundary lies near a surface; interfaces between regions count as boundary, and
// the surface has them then. Nodes inside are the middles of their edges; those of the mesh's feature edges are the
// points nearest to these on the surface's `features`, if there are any, and others on the boundary the nearest ones of
// the surface. Where an element's Jacobian would fall below a tenth of that of its
// straight form, the nodes of its edges go back half way, until none does. The determinant is a cubic polynomial, and
// its coefficients in Bernstein's form bound it (Johnen, Remacle and Geuzaine 2013, "Geometrical validity of
// curvilinear finite elements", section 3), so that it is positive everywhere in each element. Throws Error if the
// surface's triangles have no area, Cancelled.
BISECTOR_API SecondOrder second_order(const TetMesh& mesh, const TriangleMesh& surface,
                                      const std::vector<std::array<Index, 2>>& features,
                                      SecondOrderReport* report = nullptr, const Context& context = {});

// A lower bound of the Jacobian's determinant in a tetrahedron, and six times the volume of that with straight edges,
// which it is if nodes are in the middle.
struct JacobianBound {
  double least, straight;
};
BISECTOR_API JacobianBound jacobian_bound(const TetMesh& mesh, const SecondOrder& order, std::size_t tet);

}  // namespace bisector
