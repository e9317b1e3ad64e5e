// Vertices made two, as rounding leaves them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/geometry.h"

namespace bisector::test {

// Gives some of a vertex's triangles, which run all around it, to a new one beside it, with two triangles between.
inline void divide_vertex(TriangleMesh& mesh, Index v, std::size_t first, std::size_t count, const Vec3& offset) {
  std::vector<std::array<Index, 2>> sides;  // opposite to v, and the triangle
  for (Index t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      if (mesh.triangles[t][k] == v) sides.push_back({mesh.triangles[t][(k + 1) % 3], t});
  for (std::size_t k = 0; k + 1 < sides.size(); ++k) {  // each begins where the one before it ends
    const Triangle& t = mesh.triangles[sides[k][1]];
    const Index next = t[(static_cast<std::size_t>(std::find(t.begin(), t.end(), v) - t.begin()) + 2) % 3];
    std::swap(sides[k + 1], *std::find_if(sides.begin() + static_cast<std::ptrdiff_t>(k) + 1, sides.end(),
                                          [&](const auto& side) { return side[0] == next; }));
  }
  const std::size_t n = sides.size();
  const auto w = static_cast<Index>(mesh.vertices.size());
  mesh.vertices.push_back(mesh.vertices[v] + offset);
  const Index from = sides[first % n][0], to = sides[(first + count) % n][0];
  for (std::size_t k = first; k < first + count; ++k) {
    Triangle& t = mesh.triangles[sides[k % n][1]];
    std::replace(t.begin(), t.end(), v, w);
  }
  mesh.triangles.push_back({v, from, w});
  mesh.triangles.push_back({v, w, to});
}

}  // namespace bisector::test
