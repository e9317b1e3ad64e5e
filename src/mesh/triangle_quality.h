// Shapes of single triangles, and how many neighbours vertices have.
#pragma once

#include <array>
#include <vector>

#include "core/geometry.h"
#include "mesh/topology.h"

namespace bisector {

struct TriangleShape {
  double area = 0;
  double q = 0;                            // 6/sqrt(3) area/(half-perimeter longest edge); 1 is equilateral
  std::array<double, 3> theta{0, 0, 180};  // at each corner, degrees; these are those of triangles without area
};

TriangleShape measure_triangle(const Vec3& a, const Vec3& b, const Vec3& c);

struct Valences {
  std::vector<Index> neighbours;  // of each vertex, through edges
  std::vector<char> border;       // whether a vertex has an edge of one triangle
};

Valences count_neighbours(const EdgeTable& table, std::size_t vertex_count);

}  // namespace bisector
