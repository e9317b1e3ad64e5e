#include "remesh/kept.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "bisector/error.h"
#include "mesh/topology.h"
#include "remesh/topology_control.h"
#include "remesh/whole_edges.h"
#include "spatial/nearest.h"

namespace bisector {
namespace {

using Edge = std::array<Index, 2>;

// The parts of a curve between corners, `is_corner` by vertex.
std::vector<FeatureCurve> divide(FeatureCurve curve, const std::vector<char>& is_corner) {
  std::vector<Index>& on = curve.vertices;
  if (curve.closed) {
    const auto first = std::find_if(on.begin(), on.end(), [&](Index v) { return is_corner[v]; });
    if (first == on.end()) return {std::move(curve)};
    std::rotate(on.begin(), first, on.end());
    on.push_back(on.front());
    curve.closed = false;
  }
  std::vector<FeatureCurve> parts;
  for (std::size_t from = 0, to = 1; to < on.size(); ++to) {
    if (!is_corner[on[to]] && to + 1 < on.size()) continue;
    parts.push_back({{on.begin() + static_cast<std::ptrdiff_t>(from), on.begin() + static_cast<std::ptrdiff_t>(to) + 1},
                     false,
                     curve.kind});
    from = to;
  }
  return parts;
}

// Of each corner, the vertex of the result that stands there; kNone if none does.
std::vector<Index> vertices_at_corners(const RemeshResult& result, std::size_t corners) {
  std::vector<Index> at(corners, kNone);
  for (Index v = 0; v < result.places.size(); ++v)
    if (const Index corner = result.places[v].corner; corner != kNone) at[corner] = v;
  return at;
}

// The corners at both ends of an open curve.
std::array<std::size_t, 2> ends_of(const FeatureGraph& features, const FeatureCurve& curve) {
  const auto corner_at = [&](Index v) {
    const auto corner = std::lower_bound(features.corners.begin(), features.corners.end(), v);
    return static_cast<std::size_t>(corner - features.corners.begin());
  };
  return {corner_at(curve.vertices.front()), corner_at(curve.vertices.back())};
}

std::vector<VertexChain> chains_of(const KeptFeatures& kept, const FeatureGraph& features,
                                   const std::vector<Index>& at_corner, const RemeshResult& result) {
  std::vector<std::vector<std::pair<double, Index>>> inside(features.curves.size());
  for (Index v = 0; v < result.places.size(); ++v)
    if (const SeedPlace& place = result.places[v]; place.curve != kNone && kept.curves[place.curve])
      inside[place.curve].push_back({place.position, v});
  std::vector<VertexChain> chains;
  for (std::size_t c = 0; c < features.curves.size(); ++c) {
    if (!kept.curves[c]) continue;
    const auto [from, to] = ends_of(features, features.curves[c]);
    VertexChain chain{at_corner[from]};
    std::sort(inside[c].begin(), inside[c].end());
    for (const auto& [position, v] : inside[c]) chain.push_back(v);
    chain.push_back(at_corner[to]);
    chains.push_back(std::move(chain));
  }
  return chains;
}

// Takes the vertices out that no triangle uses.
void drop_unused(RemeshResult& result) {
  TriangleMesh& mesh = result.mesh;
  std::vector<Index> index(mesh.vertices.size(), kNone);
  for (const Triangle& t : mesh.triangles)
    for (const Index v : t) index[v] = 0;
  Index count = 0;
  for (std::size_t v = 0; v < index.size(); ++v) {
    if (index[v] == kNone) continue;
    mesh.vertices[count] = mesh.vertices[v];
    result.places[count] = result.places[v];
    result.kept[count] = result.kept[v];
    index[v] = count++;
  }
  mesh.vertices.resize(count);
  result.places.resize(count);
  result.kept.resize(count);
  for (Triangle& t : mesh.triangles)
    for (Index& v : t) v = index[v];
  for (Edge& e : mesh.feature_edges) e = sorted_edge(index[e[0]], index[e[1]]);
  std::sort(mesh.feature_edges.begin(), mesh.feature_edges.end());
  for (TopologyFault& fault : result.faults)
    for (Index& seed : fault.seeds)
      if (seed != kNone) seed = index[seed];
}

void take_out_divisions(const std::vector<VertexChain>& chains, const TriangleMesh& input, RemeshResult& result) {
  TriangleMesh& mesh = result.mesh;
  WholeEdgesOptions options;
  options.locked = mesh.feature_edges;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    options.movable.push_back(result.places[v].kind == SeedPlace::Kind::surface);
  const NearestOnMesh surface(input);
  options.project = [&](const Vec3& p) { return surface.nearest(p).point; };
  make_whole(mesh, chains, options);
  std::vector<Edge> links, edges;
  for (const VertexChain& chain : chains)
    for (std::size_t k = 0; k + 1 < chain.size(); ++k) links.push_back(sorted_edge(chain[k], chain[k + 1]));
  std::sort(links.begin(), links.end());
  std::set_difference(mesh.feature_edges.begin(), mesh.feature_edges.end(), links.begin(), links.end(),
                      std::back_inserter(edges));
  for (const VertexChain& chain : chains) edges.push_back(sorted_edge(chain.front(), chain.back()));
  mesh.feature_edges = std::move(edges);
  drop_unused(result);
  result.topology = analyse_topology(mesh.triangles, mesh.vertices.size());
  result.topology_matches = same_topology(result.topology, result.input_topology);
}

void check_edges(const KeptFeatures& kept, const FeatureGraph& features, const RemeshResult& result) {
  std::vector<Edge> edges;
  for (const Triangle& t : result.mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = result.kept[t[k]], b = result.kept[t[(k + 1) % 3]];
      if (a != kNone && b != kNone) edges.push_back(sorted_edge(a, b));
    }
  std::sort(edges.begin(), edges.end());
  for (std::size_t c = 0; c < features.curves.size(); ++c) {
    if (!kept.curves[c]) continue;
    const auto [from, to] = ends_of(features, features.curves[c]);
    const Edge edge = sorted_edge(kept.corners[from], kept.corners[to]);
    if (!std::binary_search(edges.begin(), edges.end(), edge))
      throw Error(
          fmt::format("the edge from vertex {} to {}, which is to be kept, is too long beside the edges "
                      "around it; ask for fewer vertices, or keep less",
                      edge[0], edge[1]));
  }
}

}  // namespace

void add_corners(FeatureGraph& graph, const std::vector<Index>& vertices) {
  if (vertices.empty()) return;
  graph.corners.insert(graph.corners.end(), vertices.begin(), vertices.end());
  std::sort(graph.corners.begin(), graph.corners.end());
  graph.corners.erase(std::unique(graph.corners.begin(), graph.corners.end()), graph.corners.end());
  Index most = graph.corners.back();
  for (const FeatureCurve& curve : graph.curves)
    for (const Index v : curve.vertices) most = std::max(most, v);
  std::vector<char> is_corner(std::size_t{most} + 1, 0);
  for (const Index v : graph.corners) is_corner[v] = 1;
  std::vector<FeatureCurve> curves;
  for (FeatureCurve& curve : graph.curves)
    for (FeatureCurve& part : divide(std::move(curve), is_corner)) curves.push_back(std::move(part));
  graph.curves = std::move(curves);
}

void restore_kept(const KeptFeatures& kept, const FeatureGraph& features, const TriangleMesh& input,
                  RemeshResult& result) {
  const std::vector<Index> at_corner = vertices_at_corners(result, features.corners.size());
  result.kept.assign(result.mesh.vertices.size(), kNone);
  for (std::size_t c = 0; c < at_corner.size(); ++c) {
    const Index of_input = kept.corners[c], v = at_corner[c];
    if (of_input == kNone) continue;
    if (v == kNone)
      throw Error(
          fmt::format("vertex {}, which is to be kept, has no place in the result; ask for more vertices", of_input));
    result.mesh.vertices[v] = input.vertices[of_input];
    result.kept[v] = of_input;
  }
  const std::vector<VertexChain> chains = chains_of(kept, features, at_corner, result);
  const auto is_divided = [](const VertexChain& chain) { return chain.size() > 2; };
  if (std::any_of(chains.begin(), chains.end(), is_divided)) take_out_divisions(chains, input, result);
  check_edges(kept, features, result);
}

}  // namespace bisector
