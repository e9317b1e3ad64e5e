// Principal curvatures of a triangle mesh by normal cycles.
#pragma once

#include <array>
#include <vector>

#include "core/geometry.h"

namespace bisector {

// Per vertex, in the reciprocal of the mesh's unit. Positive where the surface bends away from its normals, as on a
// sphere oriented outwards; where the orientation is not the same everywhere, that of the vertex's triangle of lowest
// index counts. Directions are unit tangents, zero at vertices without area around them.
struct PrincipalCurvatures {
  std::vector<double> min, max;  // min <= max
  std::vector<Vec3> min_direction, max_direction;

  // |kappa_max| of the thesis (4.5): the larger of the two in magnitude.
  double magnitude(std::size_t vertex) const;
};

// The mean of the curvature measure over the part of the surface around each vertex (Cohen-Steiner and Morvan 2003,
// "Restricted Delaunay triangulations and normal cycle"; thesis [32]), weighted by w = 1 - (distance / r)^2:
//   T = sum over edges of beta(e) int_e w e e^T / int w,
// e being the edge's unit vector and beta the signed angle between the facets' normals.
// The integrals, which are exact, are over what can be reached across edges inside a ball of radius r about the vertex,
// so irregular triangles do not matter: r is `radius` times the local edge length (that of equilateral triangles of the
// area around the vertex), or `least` if that is larger, but at most half as much more. Borders, edges of more than two
// triangles and `sharp` edges (FeatureGraph::edges) are not crossed and do not bend. Where they divide a vertex's
// triangles, the part of the largest magnitude counts.
PrincipalCurvatures principal_curvatures(const TriangleMesh& mesh, const std::vector<std::array<Index, 2>>& sharp = {},
                                         double radius = 3, double least = 0);

}  // namespace bisector
