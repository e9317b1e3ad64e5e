#include "mesh/spatial_order.h"

#include <algorithm>
#include <utility>

#include "core/parallel.h"
#include "mesh/used_vertices.h"
#include "spatial/hilbert.h"

namespace bisector {

namespace {

// The vertices that triangles use.
std::vector<Index> order_of_vertices(const TriangleMesh& mesh) {
  const std::vector<Index> vertices = used_vertices(mesh.triangles, mesh.vertices.size());
  std::vector<Vec3> points(vertices.size());
  parallel_each(points.size(), [&](std::size_t k) { points[k] = mesh.vertices[vertices[k]]; });
  std::vector<Index> order = hilbert_order(points);
  for (Index& v : order) v = vertices[v];
  return order;
}

}  // namespace

OrderedMesh in_spatial_order(const TriangleMesh& mesh) {
  OrderedMesh result;
  const std::size_t triangles = mesh.triangles.size();
  const std::vector<Index> order = order_of_vertices(mesh);
  result.vertex_of.assign(mesh.vertices.size(), kNone);
  result.mesh.vertices.resize(order.size());
  parallel_each(order.size(), [&](std::size_t k) {
    result.vertex_of[order[k]] = static_cast<Index>(k);
    result.mesh.vertices[k] = mesh.vertices[order[k]];
  });

  struct Item {
    Triangle corners;
    Index triangle;
  };
  std::vector<Item> items(triangles);
  parallel_each(triangles, [&](std::size_t t) {
    Triangle corners;
    for (int k = 0; k < 3; ++k) corners[k] = result.vertex_of[mesh.triangles[t][k]];
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    items[t] = {corners, static_cast<Index>(t)};
  });
  sort_in_parallel(items, [](const Item& a, const Item& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.triangle < b.triangle;
  });
  result.mesh.triangles.resize(triangles);
  result.mesh.face_of_triangle.resize(triangles);
  result.mesh.labels.resize(mesh.labels.empty() ? 0 : triangles);
  parallel_each(triangles, [&](std::size_t k) {
    const Index t = items[k].triangle;
    result.mesh.triangles[k] = items[k].corners;
    result.mesh.face_of_triangle[k] = mesh.face_of_triangle.empty() ? t : mesh.face_of_triangle[t];
    if (!mesh.labels.empty()) result.mesh.labels[k] = mesh.labels[t];
  });
  for (const auto& [a, b] : mesh.feature_edges)
    result.mesh.feature_edges.push_back({result.vertex_of[a], result.vertex_of[b]});
  return result;
}

}  // namespace bisector
