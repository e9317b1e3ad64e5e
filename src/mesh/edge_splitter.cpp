#include "mesh/edge_splitter.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "core/geometry.h"

namespace bisector {

EdgeSplitter::EdgeSplitter(TriangleMesh& mesh) : mesh_(mesh), at_(mesh.vertices.size()) {
  for (Index t = 0; t < mesh.triangles.size(); ++t)
    for (const Index v : mesh.triangles[t]) at_[v].push_back(t);
  if (!mesh.face_of_triangle.empty()) return;
  mesh.face_of_triangle.resize(mesh.triangles.size());
  std::iota(mesh.face_of_triangle.begin(), mesh.face_of_triangle.end(), Index{0});
}

Index EdgeSplitter::split(Index a, Index b, double t) {
  const auto middle = static_cast<Index>(mesh_.vertices.size());
  mesh_.vertices.push_back(mesh_.vertices[a] + t * (mesh_.vertices[b] - mesh_.vertices[a]));
  at_.emplace_back();
  for (const Index first : std::vector<Index>(at_[a])) {
    Triangle& corners = mesh_.triangles[first];
    std::size_t k = 0;
    while (k < 3 && !((corners[k] == a && corners[(k + 1) % 3] == b) || (corners[k] == b && corners[(k + 1) % 3] == a)))
      ++k;
    if (k == 3) continue;
    const Index end = corners[(k + 1) % 3], apex = corners[(k + 2) % 3];
    Triangle rest = corners;
    corners[(k + 1) % 3] = middle;
    rest[k] = middle;
    const auto second = static_cast<Index>(mesh_.triangles.size());
    mesh_.triangles.push_back(rest);
    mesh_.face_of_triangle.push_back(Index{mesh_.face_of_triangle[first]});
    if (!mesh_.labels.empty()) mesh_.labels.push_back(std::int32_t{mesh_.labels[first]});
    std::replace(at_[end].begin(), at_[end].end(), first, second);
    at_[apex].push_back(second);
    at_[middle].insert(at_[middle].end(), {first, second});
  }
  return middle;
}

}  // namespace bisector
