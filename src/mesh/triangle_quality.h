// Shapes of single triangles, and how many neighbours vertices have.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
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

// The smallest angle of a triangle with corners among the mesh's vertices, degrees.
double least_angle(const TriangleMesh& mesh, const Triangle& t);

// Over the longest edge; 0 of a point.
inline double triangle_height(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double longest = std::sqrt(std::max({norm2(b - a), norm2(c - b), norm2(a - c)}));
  return longest > 0 ? norm(twice_area_normal(a, b, c)) / longest : 0;
}

// Barycentric coordinates of a point in the plane of a triangle that has an area.
inline std::array<double, 3> barycentric_weights(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 n = twice_area_normal(a, b, c);
  const double scale = 1 / norm2(n);
  const double second = dot(cross(p - a, c - a), n) * scale, third = dot(cross(b - a, p - a), n) * scale;
  return {1 - second - third, second, third};
}

struct Valences {
  std::vector<Index> neighbours;  // of each vertex, through edges
  std::vector<char> border;       // whether a vertex has an edge of one triangle
};

Valences count_neighbours(const EdgeTable& table, std::size_t vertex_count);

}  // namespace bisector
