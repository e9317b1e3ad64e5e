#include "bisector/tetmesh/conform.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "bisector/core/error.h"
#include "bisector/tetmesh/carve.h"
#include "bisector/voronoi/delaunay_tets.h"

namespace bisector {

namespace {

void check_points(const std::vector<Vec3>& vertices) {
  std::vector<std::size_t> order(vertices.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t v) { return std::tuple(vertices[v].x, vertices[v].y, vertices[v].z, v); };
  for (std::size_t v = 0; v < vertices.size(); ++v)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(vertices[v][k]))
        throw Error(fmt::format("vertex {}: a coordinate is not finite; mend the vertex", v));
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  for (std::size_t i = 1; i < order.size(); ++i)
    if (vertices[order[i]] == vertices[order[i - 1]])
      throw Error(fmt::format("the vertices {} and {} lie at the same point; merge them", order[i - 1], order[i]));
}

}  // namespace

ConformingTets conforming_tets(const TriangleMesh& boundary, const std::vector<Vec3>& points,
                               const TetgenOptions& options, const Context& context) {
  ConformingTets result;
  std::vector<Vec3> vertices = boundary.vertices;
  vertices.insert(vertices.end(), points.begin(), points.end());
  check_points(vertices);
  std::vector<Index> active;  // all but vertices that no triangle uses
  std::vector<char> used(vertices.size(), 0);
  for (const Triangle& t : boundary.triangles)
    for (const Index v : t) used[v] = 1;
  for (Index v = 0; v < vertices.size(); ++v)
    if (used[v] || v >= boundary.vertices.size()) active.push_back(v);
  std::vector<Vec3> positions;
  for (const Index v : active) positions.push_back(vertices[v]);
  std::vector<Tetrahedron> all = delaunay_tets(positions);
  for (Tetrahedron& t : all)
    for (Index& v : t) v = active[v];
  Carved carved = carve(all, boundary.triangles);
  result.missing = carved.missing;
  context.check();
  if (carved.missing == 0) {
    used.assign(vertices.size(), 0);
    for (const Tetrahedron& t : carved.tets)
      for (const Index v : t) used[v] = 1;
    for (std::size_t v = boundary.vertices.size(); v < vertices.size(); ++v)
      if (!used[v])
        throw Error(fmt::format("point {} is not inside the surface; leave it out", v - boundary.vertices.size()));
    result.delaunay = true;
    result.mesh = {std::move(vertices), std::move(carved.tets), {},
                   boundary.triangles,  boundary.labels,        boundary.feature_edges};
    return result;
  }
  if (find_tetgen().empty() && options.program.empty())
    throw Error(
        fmt::format("{} of {} boundary triangles are no Delaunay facets (first: {}), and TetGen, which could fit "
                    "tetrahedra to them, is "
                    "not there; build with BISECTOR_TETGEN or set BISECTOR_TETGEN to the path of bisector-tetgen",
                    carved.missing, boundary.triangles.size(), carved.first_missing));
  TetgenResult tets = tetgen_tets(boundary, points, options, context);
  result.mesh = std::move(tets.mesh);
  result.steiner_points = tets.steiner_points;
  result.zero_volume = tets.zero_volume;
  return result;
}

}  // namespace bisector
