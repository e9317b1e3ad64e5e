#include "bisector/second_order.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/tet_adjacency.h"
#include "mesh/tet_topology.h"
#include "mesh/topology.h"
#include "spatial/nearest.h"

namespace bisector {

namespace {

using Edge = std::array<Index, 2>;

constexpr double kLeastShare = 0.1;  // of the straight element's Jacobian
constexpr double kFarthest = 0.3;    // of an edge's length: what is farther off is another part of the surface
constexpr int kHalvings = 6;         // before a node goes back to the middle
constexpr int kTetEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

std::vector<Edge> sorted_edges(std::vector<Edge> edges) {
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

Vec3 middle(const TetMesh& mesh, const Edge& e) { return 0.5 * (mesh.vertices[e[0]] + mesh.vertices[e[1]]); }

// Where the nodes of boundary edges would be.
struct Targets {
  std::vector<std::size_t> edges;  // of the boundary, as places in SecondOrder::edges
  std::vector<Vec3> middles, points;
  std::vector<char> near;     // near enough to be used
  std::vector<int> halvings;  // kHalvings: in the middle

  Vec3 node(std::size_t i) const {
    if (!near[i] || halvings[i] >= kHalvings) return middles[i];
    return middles[i] + std::ldexp(1.0, -halvings[i]) * (points[i] - middles[i]);
  }
};

Targets find_targets(const TetMesh& mesh, const SecondOrder& order, const NearestOnMesh& on_surface,
                     const NearestOnEdges* on_features) {
  Targets targets;
  std::vector<Edge> boundary;
  for (const Triangle& t : wall_facets(mesh))
    for (std::size_t k = 0; k < 3; ++k) boundary.push_back(sorted_edge(t[k], t[(k + 1) % 3]));
  boundary = sorted_edges(std::move(boundary));
  for (const Edge& e : boundary) targets.edges.push_back(order.node_of(e[0], e[1]));
  targets.middles.resize(boundary.size());
  targets.points.resize(boundary.size());
  targets.near.resize(boundary.size());
  targets.halvings.assign(boundary.size(), 0);
  parallel_each(boundary.size(), [&](std::size_t i) {
    const Edge& e = boundary[i];
    const Vec3 m = middle(mesh, e);
    const bool feature = on_features && std::binary_search(mesh.feature_edges.begin(), mesh.feature_edges.end(), e);
    targets.middles[i] = m;
    targets.points[i] = feature ? on_features->nearest(m) : on_surface.nearest(m).point;
    targets.near[i] = norm(targets.points[i] - m) <= kFarthest * norm(mesh.vertices[e[1]] - mesh.vertices[e[0]]);
  });
  return targets;
}

// Halves the way of boundary nodes until all Jacobians are bounded.
void hold_back(const TetMesh& mesh, Targets& targets, SecondOrder& order, const Context& context) {
  std::vector<std::size_t> target_of(order.edges.size(), std::numeric_limits<std::size_t>::max());
  for (std::size_t i = 0; i < targets.edges.size(); ++i) target_of[targets.edges[i]] = i;
  std::vector<char> back(targets.edges.size(), 0);
  for (bool any = true; any;) {
    context.check();
    parallel_each(targets.edges.size(), [&](std::size_t i) { order.nodes[targets.edges[i]] = targets.node(i); });
    std::vector<char> bad(mesh.tets.size(), 0);
    parallel_each(mesh.tets.size(), [&](std::size_t t) {
      const JacobianBound bound = jacobian_bound(mesh, order, t);
      bad[t] = bound.straight > 0 && bound.least < kLeastShare * bound.straight;
    });
    any = false;
    std::fill(back.begin(), back.end(), 0);
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
      if (!bad[t]) continue;
      for (const auto& [a, b] : kTetEdges) {
        const std::size_t i = target_of[order.node_of(mesh.tets[t][static_cast<std::size_t>(a)],
                                                      mesh.tets[t][static_cast<std::size_t>(b)])];
        if (i >= back.size() || !targets.near[i] || targets.halvings[i] >= kHalvings) continue;
        back[i] = 1;
        any = true;
      }
    }
    for (std::size_t i = 0; i < back.size(); ++i) targets.halvings[i] += back[i];
  }
}

SecondOrderReport measure(const TetMesh& mesh, const SecondOrder& order, const Targets& targets,
                          const NearestOnMesh& nearest) {
  SecondOrderReport report;
  report.boundary_nodes = targets.edges.size();
  std::vector<double> of_nodes(targets.edges.size()), of_middles(targets.edges.size());
  parallel_each(targets.edges.size(), [&](std::size_t i) {
    const Vec3 node = targets.node(i);
    of_nodes[i] = norm(nearest.nearest(node).point - node);
    of_middles[i] = norm(nearest.nearest(targets.middles[i]).point - targets.middles[i]);
  });
  for (std::size_t i = 0; i < targets.edges.size(); ++i) {
    report.curved += !(targets.node(i) == targets.middles[i]);
    report.held_back += !targets.near[i] || targets.halvings[i] > 0;
    report.node_distance_max = std::max(report.node_distance_max, of_nodes[i]);
    report.middle_distance_max = std::max(report.middle_distance_max, of_middles[i]);
  }
  const double n = static_cast<double>(std::max<std::size_t>(1, targets.edges.size()));
  report.node_distance_mean = fixed_sum(of_nodes.size(), [&](std::size_t i) { return of_nodes[i]; }) / n;
  report.middle_distance_mean = fixed_sum(of_middles.size(), [&](std::size_t i) { return of_middles[i]; }) / n;
  std::vector<double> shares(mesh.tets.size(), 1);
  parallel_each(shares.size(), [&](std::size_t t) {
    const JacobianBound bound = jacobian_bound(mesh, order, t);
    if (bound.straight > 0) shares[t] = bound.least / bound.straight;
  });
  for (const double share : shares) report.jacobian_min = std::min(report.jacobian_min, share);
  return report;
}

}  // namespace

Index SecondOrder::node_of(Index a, Index b) const {
  const Edge e = sorted_edge(a, b);
  const auto at = std::lower_bound(edges.begin(), edges.end(), e);
  return at == edges.end() || *at != e ? kNone : static_cast<Index>(at - edges.begin());
}

// Derivatives of the map by three of the barycentric coordinates are linear in these; a product of three of them has
// the coefficients below.
JacobianBound jacobian_bound(const TetMesh& mesh, const SecondOrder& order, std::size_t tet) {
  const Tetrahedron& v = mesh.tets[tet];
  Vec3 control[4][4];  // of the quadratic map
  for (std::size_t i = 0; i < 4; ++i) control[i][i] = mesh.vertices[v[i]];
  for (const auto& [a, b] : kTetEdges) {
    const Vec3 &p = control[a][a], &q = control[b][b];
    const Vec3 node = order.nodes[order.node_of(v[static_cast<std::size_t>(a)], v[static_cast<std::size_t>(b)])];
    control[a][b] = control[b][a] = 2 * node - 0.5 * (p + q);
  }
  Vec3 derivative[3][4];  // by coordinate k + 1, at corner i
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 4; ++i) derivative[k][i] = control[i][k + 1] - control[i][0];
  // Sums of the determinants for each product of three coordinates, told by how often each occurs, and how many they
  // are.
  double sums[64] = {};
  int counts[64] = {};
  const auto slot = [](std::size_t i, std::size_t j, std::size_t k) {
    std::array<std::size_t, 3> s{i, j, k};
    std::sort(s.begin(), s.end());
    return 16 * s[0] + 4 * s[1] + s[2];
  };
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t k = 0; k < 4; ++k) {
        sums[slot(i, j, k)] += dot(derivative[0][i], cross(derivative[1][j], derivative[2][k]));
        ++counts[slot(i, j, k)];
      }
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t s = 0; s < 64; ++s)
    if (counts[s] > 0) least = std::min(least, sums[s] / counts[s]);
  // The derivatives lack the factor 2 of a quadratic map: at straight edges they are half of the edges.
  return {8 * least, rounded_six_volume(control[0][0], control[1][1], control[2][2], control[3][3])};
}

SecondOrder second_order(const TetMesh& mesh, const TriangleMesh& surface, const std::vector<Edge>& features,
                         SecondOrderReport* report, const Context& context) {
  SecondOrder order;
  order.edges.reserve(6 * mesh.tets.size());
  for (const Tetrahedron& t : mesh.tets)
    for (const auto& [a, b] : kTetEdges)
      order.edges.push_back(sorted_edge(t[static_cast<std::size_t>(a)], t[static_cast<std::size_t>(b)]));
  order.edges = sorted_edges(std::move(order.edges));
  order.nodes.resize(order.edges.size());
  parallel_each(order.edges.size(), [&](std::size_t e) { order.nodes[e] = middle(mesh, order.edges[e]); });
  const NearestOnMesh on_surface(surface);
  std::optional<NearestOnEdges> on_features;
  if (!features.empty()) on_features.emplace(surface.vertices, features);
  context.check();
  Targets targets = find_targets(mesh, order, on_surface, on_features ? &*on_features : nullptr);
  hold_back(mesh, targets, order, context);
  if (report) *report = measure(mesh, order, targets, on_surface);
  return order;
}

}  // namespace bisector
