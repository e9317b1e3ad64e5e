#include "remesh/cut_sheets.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "core/degenerate.h"
#include "core/geometry.h"
#include "features/edge_splits.h"
#include "mesh/corefine.h"
#include "mesh/topology.h"
#include "mesh/touching.h"
#include "remesh/mend_input.h"
#include "remesh/sizing.h"

namespace bisector {
namespace {

using Edge = std::array<Index, 2>;

// Of triangles that cross, from which on they are more of a tangle than sheets.
constexpr std::size_t kMostPairs = 10'000;

std::vector<Edge> edges_after(const EdgeSplits& splits, const std::vector<Edge>& edges) {
  std::vector<Edge> parts;
  for (const auto& [a, b] : edges) {
    const std::vector<Index> chain = edge_chain(splits, a, b);
    for (std::size_t k = 1; k < chain.size(); ++k) parts.push_back({chain[k - 1], chain[k]});
  }
  return parts;
}

// Of each triangle the part that it bounds, once all that touch are separated; empty if that leaves no manifold.
std::vector<Index> parts_of(TriangleMesh mesh, Touching touching) {
  const std::size_t count = mesh.triangles.size();
  mesh.feature_edges.clear();
  mesh.face_of_triangle.resize(count);
  std::iota(mesh.face_of_triangle.begin(), mesh.face_of_triangle.end(), Index{0});
  halve_touching_edges(mesh, touching);
  separate_touching(mesh, touching);
  if (!analyse_topology(mesh.triangles, mesh.vertices.size()).manifold) return {};
  const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  std::vector<Index> part(count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    part[mesh.face_of_triangle[t]] = component[mesh.triangles[t][0]];
  return part;
}

// Those without room for a triangle of this area. How many there were.
std::size_t remove_small_parts(TriangleMesh& mesh, const std::vector<Index>& part, double area) {
  std::map<Index, double> areas;
  for (std::size_t t = 0; t < part.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    areas[part[t]] += triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
  }
  std::erase_if(areas, [&](const auto& item) { return item.second >= area; });
  if (areas.empty()) return 0;
  const std::vector<Triangle> triangles = std::exchange(mesh.triangles, {});
  const std::vector<std::int32_t> labels = std::exchange(mesh.labels, {});
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (areas.contains(part[t])) continue;
    mesh.triangles.push_back(triangles[t]);
    if (!labels.empty()) mesh.labels.push_back(std::int32_t{labels[t]});
  }
  return areas.size();
}

}  // namespace

std::optional<CutSheets> cut_sheets(const OrderedInput& input) {
  WeldResult welded = weld_and_mend(input, {});
  TriangleMesh mesh = std::exchange(welded.mesh, {});
  const MeshTopology before = analyse_topology(mesh.triangles, mesh.vertices.size());
  if (!before.closed && before.non_manifold_edges > 0) return std::nullopt;
  const Touching touching = before.non_manifold_edges > 0 ? Touching::solids : Touching::sheets;
  const std::optional<Corefinement> cut = corefine_sheets(mesh, kMostPairs);
  if (!cut) return std::nullopt;

  RemeshOptions options = input.options;
  rename_edges(welded.vertex_of, options.features.given);
  options.features.given = edges_after(cut->splits, options.features.given);
  if (std::vector<double>& values = options.sizing.attribute; !values.empty()) {
    std::vector<double> after(mesh.vertices.size());
    for (std::size_t v = values.size(); v-- > 0;)
      if (welded.vertex_of[v] != kNone) after[welded.vertex_of[v]] = values[v];
    for (const InsertedVertex& v : cut->inserted) {
      double value = 0;
      for (std::size_t k = 0; k < 3; ++k) value += v.weights[k] * after[mesh.triangles[v.triangle][k]];
      after.push_back(value);
    }
    values = std::move(after);
  }
  std::vector<Edge> feature_edges = edges_after(cut->splits, mesh.feature_edges);
  mesh = cut->mesh;
  mesh.face_of_triangle.clear();
  mesh.feature_edges = std::move(feature_edges);

  const std::size_t edges = analyse_topology(mesh.triangles, mesh.vertices.size()).non_manifold_edges;
  const std::vector<Index> part = parts_of(mesh, touching);
  if (part.empty()) return std::nullopt;
  const double unit_edge = compute_sizing(mesh, {}, target_of(options)).unit_edge;
  const std::size_t removed = remove_small_parts(mesh, part, std::numbers::sqrt3 / 4 * unit_edge * unit_edge);
  if (removed > 0) {
    // Edges of what is left.
    const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
    for (auto* named : {&mesh.feature_edges, &options.features.given})
      std::erase_if(*named, [&](const Edge& e) {
        return !std::binary_search(table.edges.begin(), table.edges.end(), sorted_edge(e[0], e[1]));
      });
  }
  OrderedInput ordered(mesh, options);
  std::vector<Index> vertex_of = input.vertex_of;
  for (Index& v : vertex_of)
    if (v != kNone && (v = welded.vertex_of[v]) != kNone) v = ordered.vertex_of[v];
  ordered.vertex_of = std::move(vertex_of);
  ordered.touching = touching;
  return CutSheets{std::move(ordered), std::move(welded), edges, removed};
}

}  // namespace bisector
