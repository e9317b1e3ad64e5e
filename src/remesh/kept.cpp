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

// Of an edge that is to be whole: with ever more of them, the next result gets ever shorter edges there.
constexpr std::size_t kMostParts = 3;

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

// The cells of a border's corner at an obtuse angle and of its two neighbours may meet nowhere on the surface. Then the
// dual's border leads from one neighbour to the other, and lacks the triangle of the three, which is added. False if
// that is not so.
bool add_ear(std::size_t corner, const std::vector<Index>& neighbours, RemeshResult& result) {
  if (neighbours.size() != 2) return false;
  const Index a = neighbours[0], b = neighbours[1];
  if (a == kNone || b == kNone) return false;
  TriangleMesh& mesh = result.mesh;
  std::vector<std::size_t> beside;  // triangles on the edge from one neighbour to the other
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& v = mesh.triangles[t];
    if (std::count(v.begin(), v.end(), a) > 0 && std::count(v.begin(), v.end(), b) > 0) beside.push_back(t);
  }
  if (beside.size() != 1) return false;
  const Triangle beyond = mesh.triangles[beside.front()];
  const auto k = static_cast<std::size_t>(std::find(beyond.begin(), beyond.end(), a) - beyond.begin());
  const auto added = static_cast<Index>(mesh.vertices.size());
  mesh.vertices.emplace_back();
  mesh.triangles.push_back(beyond[(k + 1) % 3] == b ? Triangle{b, a, added} : Triangle{a, b, added});
  if (!mesh.labels.empty()) mesh.labels.push_back(std::int32_t{mesh.labels[beside.front()]});
  SeedPlace place;
  place.kind = SeedPlace::Kind::fixed;
  place.corner = static_cast<Index>(corner);
  result.places.push_back(place);
  return true;
}

// The corners that are kept, and the vertices along each edge that is, from corner to corner.
struct KeptEdge {
  std::array<std::size_t, 2> corners;
  VertexChain chain;
};

// Of the curves that `kept` has a value for.
std::vector<KeptEdge> kept_edges(const std::vector<char>& kept, const FeatureGraph& features,
                                 const std::vector<Index>& at_corner, const RemeshResult& result) {
  std::vector<std::vector<std::pair<double, Index>>> inside(features.curves.size());
  for (Index v = 0; v < result.places.size(); ++v)
    if (const SeedPlace& place = result.places[v]; place.curve != kNone && kept[place.curve])
      inside[place.curve].push_back({place.position, v});
  std::vector<KeptEdge> edges;
  for (std::size_t c = 0; c < features.curves.size(); ++c) {
    if (!kept[c]) continue;
    const auto [from, to] = ends_of(features, features.curves[c]);
    VertexChain chain{at_corner[from]};
    std::sort(inside[c].begin(), inside[c].end());
    for (const auto& [position, v] : inside[c]) chain.push_back(v);
    chain.push_back(at_corner[to]);
    edges.push_back({{from, to}, std::move(chain)});
  }
  return edges;
}

void add_missing_corners(const KeptFeatures& kept, std::vector<KeptEdge>& edges, std::vector<Index>& at_corner,
                         RemeshResult& result) {
  for (std::size_t c = 0; c < at_corner.size(); ++c) {
    if (kept.corners[c] == kNone || at_corner[c] != kNone) continue;
    std::vector<Index> neighbours;
    for (const KeptEdge& edge : edges) {
      if (edge.corners[0] == c) neighbours.push_back(edge.chain[1]);
      if (edge.corners[1] == c) neighbours.push_back(edge.chain[edge.chain.size() - 2]);
    }
    if (!add_ear(c, neighbours, result)) continue;
    at_corner[c] = static_cast<Index>(result.mesh.vertices.size() - 1);
    for (KeptEdge& edge : edges) {
      if (edge.corners[0] == c) edge.chain.front() = at_corner[c];
      if (edge.corners[1] == c) edge.chain.back() = at_corner[c];
    }
  }
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
    if (!result.kept.empty()) result.kept[count] = result.kept[v];
    index[v] = count++;
  }
  mesh.vertices.resize(count);
  result.places.resize(count);
  if (!result.kept.empty()) result.kept.resize(count);
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
  make_whole(mesh, chains, std::move(options));
  result.places.resize(mesh.vertices.size());
  if (!result.kept.empty()) result.kept.resize(mesh.vertices.size(), kNone);
  // Of edges that stay divided the parts are features still.
  std::vector<Edge> sides, links, whole;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) sides.push_back(sorted_edge(t[k], t[(k + 1) % 3]));
  std::sort(sides.begin(), sides.end());
  for (const VertexChain& chain : chains) {
    const Edge edge = sorted_edge(chain.front(), chain.back());
    const bool is_whole = std::binary_search(sides.begin(), sides.end(), edge);
    if (is_whole) whole.push_back(edge);
    for (std::size_t k = 0; k + 1 < chain.size(); ++k)
      if (const Edge link = sorted_edge(chain[k], chain[k + 1]);
          is_whole || !std::binary_search(sides.begin(), sides.end(), link))
        links.push_back(link);
  }
  std::sort(links.begin(), links.end());
  std::vector<Edge> edges;
  std::set_difference(mesh.feature_edges.begin(), mesh.feature_edges.end(), links.begin(), links.end(),
                      std::back_inserter(edges));
  edges.insert(edges.end(), whole.begin(), whole.end());
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

std::array<std::size_t, 2> ends_of(const FeatureGraph& features, const FeatureCurve& curve) {
  const auto corner_at = [&](Index v) {
    const auto corner = std::lower_bound(features.corners.begin(), features.corners.end(), v);
    return static_cast<std::size_t>(corner - features.corners.begin());
  };
  return {corner_at(curve.vertices.front()), corner_at(curve.vertices.back())};
}

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
  std::vector<Index> at_corner = vertices_at_corners(result, features.corners.size());
  std::vector<KeptEdge> edges = kept_edges(kept.curves, features, at_corner, result);
  add_missing_corners(kept, edges, at_corner, result);
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
  std::vector<VertexChain> chains;
  for (KeptEdge& edge : edges) chains.push_back(std::move(edge.chain));
  if (!chains.empty()) take_out_divisions(chains, input, result);
  check_edges(kept, features, result);
}

SizeBounds make_curves_whole(const std::vector<char>& whole, const FeatureGraph& features, const TriangleMesh& surface,
                             RemeshResult& result) {
  const std::vector<Index> at_corner = vertices_at_corners(result, features.corners.size());
  std::vector<VertexChain> chains;
  SizeBounds divided;
  for (KeptEdge& edge : kept_edges(whole, features, at_corner, result)) {
    VertexChain& chain = edge.chain;
    if (chain.size() <= 2 || chain.front() == kNone || chain.back() == kNone) continue;
    const Vec3 &a = result.mesh.vertices[chain.front()], &b = result.mesh.vertices[chain.back()];
    const auto parts = static_cast<double>(std::min(chain.size() - 1, kMostParts));
    for (const double t : {0.0, 0.5, 1.0}) {
      divided.points.push_back((1 - t) * a + t * b);
      divided.lengths.push_back(norm(b - a) / parts);
    }
    chains.push_back(std::move(chain));
  }
  if (!chains.empty()) take_out_divisions(chains, surface, result);
  return divided;
}

}  // namespace bisector
