// A tetrahedral mesh with a density, prepared as the domain of clipped Voronoi diagrams (thesis 5.3).
#pragma once

#include <array>
#include <vector>

#include "core/geometry.h"
#include "voronoi/moments.h"
#include "voronoi/surface.h"

namespace bisector {

struct Solid {
  // `density`: one positive value per vertex, linear on each tetrahedron; empty means 1. Tetrahedra of either
  // orientation are accepted and turned positive; those of exactly no volume keep their index and are left out, and
  // count as absent where it is asked what lies across a facet. Throws Error if there is no volume, a facet has more
  // than two tetrahedra or two on one side, a coordinate is not finite, a density is not positive and finite, or an
  // index is out of range.
  explicit Solid(TetMesh mesh, std::vector<double> density = {});

  TetMesh mesh;
  std::vector<double> density;                 // per vertex, or empty
  std::vector<double> six_volumes;             // six times the volume of each tetrahedron; 0 for those left out
  std::vector<std::array<Index, 4>> adjacent;  // of each tetrahedron, across facet k (mesh/tet_adjacency.h)
  // The facets with one tetrahedron, counter-clockwise seen from outside, with the solid's vertices and density.
  Surface boundary;
  std::vector<Index> tet_of_triangle;  // of each triangle of `boundary`
  double volume = 0;
  double mass = 0;  // integral of the density
  Box box;
  // Corners of a positively oriented tetrahedron that holds the solid, and that every clip of a whole cell starts from.
  std::array<Vec3, 4> enclosure;
};

}  // namespace bisector
