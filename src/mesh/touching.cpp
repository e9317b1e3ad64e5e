#include "mesh/touching.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <unordered_map>
#include <utility>

#include "core/disjoint_sets.h"
#include "core/geometry.h"
#include "mesh/edge_splitter.h"
#include "mesh/half_edges.h"
#include "mesh/joining.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

using HalfEdgePair = std::array<std::size_t, 2>;

// Radians: what is farther apart at an edge does not coincide, however short the edge is and flat the triangles.
constexpr double kMostRounding = 0.1;

// A triangle at an edge, seen along it.
struct Wing {
  std::size_t half_edge;
  bool forward;  // it runs from the lower vertex to the higher one: the solid lies at lower angles
  double angle, rounding;
};

// Triangles across a solid from each other, where as many run along the edge one way as the other; else none.
std::vector<HalfEdgePair> pairs_across_solids(const TriangleMesh& mesh, const EdgeTable& table, std::size_t edge,
                                              double rounding) {
  const auto [a, b] = table.edges[edge];
  const double length = norm(mesh.vertices[b] - mesh.vertices[a]);
  if (!(length > 0)) return {};
  const Vec3 axis = (1 / length) * (mesh.vertices[b] - mesh.vertices[a]);
  const Vec3 x = perpendicular(axis), y = cross(axis, x);
  std::vector<Wing> wings;
  for (const std::size_t* h = table.half_edges.begin(edge); h != table.half_edges.end(edge); ++h) {
    const Vec3 out = mesh.vertices[origin(mesh.triangles, next_half_edge(next_half_edge(*h)))] - mesh.vertices[a];
    const double u = dot(out, x), v = dot(out, y), height = std::hypot(u, v);
    if (!(height > 0)) return {};
    // The line of a short edge turns by more, and a corner that is far along it is off by as much more.
    const double off = rounding * (1 + std::abs(dot(out, axis)) / length);
    wings.push_back({*h, origin(mesh.triangles, *h) == a, std::atan2(v, u), std::min(off / height, kMostRounding)});
  }
  std::sort(wings.begin(), wings.end(), [](const Wing& p, const Wing& q) { return p.angle < q.angle; });
  // From the widest gap on, so that no coincident triangles are torn apart.
  std::size_t start = 0;
  double widest = wings.front().angle + 2 * std::numbers::pi - wings.back().angle;
  for (std::size_t k = 1; k < wings.size(); ++k)
    if (const double gap = wings[k].angle - wings[k - 1].angle; gap > widest) {
      widest = gap;
      start = k;
    }
  for (std::size_t k = 0; k < start; ++k) wings[k].angle += 2 * std::numbers::pi;
  std::rotate(wings.begin(), wings.begin() + static_cast<std::ptrdiff_t>(start), wings.end());
  // Of triangles that coincide, those come first that solids end with.
  for (auto first = wings.begin(); first != wings.end();) {
    auto last = first + 1;
    while (last != wings.end() && last->angle - (last - 1)->angle <= last->rounding + (last - 1)->rounding) ++last;
    std::stable_partition(first, last, [](const Wing& w) { return w.forward; });
    first = last;
  }
  // Pairs nest like brackets, which begin where the fewest are open.
  int open = 0, fewest = 0;
  std::size_t begin = 0;
  for (std::size_t k = 0; k < wings.size(); ++k) {
    open += wings[k].forward ? -1 : 1;
    if (open < fewest) {
      fewest = open;
      begin = k + 1;
    }
  }
  if (open != 0) return {};
  std::rotate(wings.begin(), wings.begin() + static_cast<std::ptrdiff_t>(begin), wings.end());
  std::vector<HalfEdgePair> pairs;
  std::vector<std::size_t> opened;
  for (const Wing& wing : wings) {
    if (!wing.forward) {
      opened.push_back(wing.half_edge);
      continue;
    }
    pairs.push_back({opened.back(), wing.half_edge});
    opened.pop_back();
  }
  return pairs;
}

// The edges where solids touch, each with its pairs of triangles.
using Contacts = std::unordered_map<std::size_t, std::vector<HalfEdgePair>>;

Contacts find_contacts(const TriangleMesh& mesh, const EdgeTable& table, Touching touching) {
  const double rounding = kRounding * bounding_box(mesh).diagonal();
  Contacts contacts;
  const std::vector<Index> part = label_components(mesh.triangles, mesh.vertices.size());
  std::set<Index> no_solids;
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    const std::size_t count = table.half_edges.size(e), *sides = table.half_edges.begin(e);
    const Index of = part[table.edges[e][0]];
    if (count == 2 && origin(mesh.triangles, sides[0]) != origin(mesh.triangles, sides[1])) continue;
    if (no_solids.contains(of) || (touching == Touching::sheets && count < 3)) continue;
    std::vector<HalfEdgePair> pairs;
    if (count > 2) pairs = pairs_across_solids(mesh, table, e, rounding);
    if (!pairs.empty()) contacts.emplace(e, std::move(pairs));
    else if (touching == Touching::solids) no_solids.insert(of);
  }
  std::erase_if(contacts, [&](const auto& c) { return no_solids.contains(part[table.edges[c.first][0]]); });
  return contacts;
}

// Links the corners (3 t + k) of each fan.
DisjointSets<> find_fans(const TriangleMesh& mesh, const EdgeTable& table, const Contacts& contacts) {
  const std::vector<Triangle>& triangles = mesh.triangles;
  DisjointSets<> fans(3 * triangles.size());
  const auto join = [&](std::size_t e, std::size_t g, std::size_t h) {
    for (const Index v : table.edges[e]) fans.join(corner_at(triangles, g, v), corner_at(triangles, h, v));
  };
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    if (const auto contact = contacts.find(e); contact != contacts.end()) {
      for (const auto& [g, h] : contact->second) join(e, g, h);
      continue;
    }
    const std::size_t* sides = table.half_edges.begin(e);
    for (std::size_t s = 1; s < table.half_edges.size(e); ++s) join(e, sides[0], sides[s]);
  }
  return fans;
}

}  // namespace

std::vector<std::array<Index, 2>> halve_touching_edges(TriangleMesh& mesh, Touching touching) {
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  const Contacts contacts = find_contacts(mesh, table, touching);
  if (contacts.empty()) return {};
  DisjointSets<> fans = find_fans(mesh, table, contacts);
  std::vector<std::size_t> held;  // edges
  for (const auto& [e, pairs] : contacts) {
    std::set<std::array<std::size_t, 2>> ends;
    for (const HalfEdgePair& pair : pairs)
      ends.insert({fans.root(corner_at(mesh.triangles, pair[0], table.edges[e][0])),
                   fans.root(corner_at(mesh.triangles, pair[0], table.edges[e][1]))});
    if (ends.size() < pairs.size()) held.push_back(e);
  }
  if (held.empty()) return {};
  std::sort(held.begin(), held.end());
  EdgeSplitter splitter(mesh);
  std::vector<std::array<Index, 2>> halved;
  for (const std::size_t e : held) {
    const auto [low, high] = table.edges[e];
    splitter.split(low, high, 0.5);
    halved.push_back({low, high});
  }
  mesh.feature_edges = edges_after_halving(mesh.feature_edges, halved, mesh.vertices.size());
  return halved;
}

std::vector<Index> separate_touching(TriangleMesh& mesh, Touching touching) {
  const std::size_t count = mesh.vertices.size();
  std::vector<Index> original(count);
  std::iota(original.begin(), original.end(), Index{0});
  const EdgeTable table = edge_table(mesh.triangles, count);
  DisjointSets<> fans = find_fans(mesh, table, find_contacts(mesh, table, touching));
  constexpr std::size_t kUnseen = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> first(count, kUnseen);  // fan of each vertex
  std::unordered_map<std::size_t, Index> copies;   // of the other fans
  const std::vector<Triangle> before = mesh.triangles;
  for (std::size_t corner = 0; corner < 3 * before.size(); ++corner) {
    const Index v = origin(before, corner);
    const std::size_t fan = fans.root(corner);
    if (first[v] == kUnseen) first[v] = fan;
    if (first[v] == fan) continue;
    const auto [copy, is_new] = copies.try_emplace(fan, static_cast<Index>(mesh.vertices.size()));
    if (is_new) {
      mesh.vertices.push_back(Vec3(mesh.vertices[v]));
      original.push_back(v);
    }
    mesh.triangles[corner / 3][corner % 3] = copy->second;
  }
  mesh.feature_edges = edges_after_separating(mesh, original, mesh.feature_edges);
  return original;
}

bool has_solids_with_common_faces(TriangleMesh mesh) {
  halve_touching_edges(mesh);
  const std::vector<Index> original = separate_touching(mesh);
  const MeshTopology topology = analyse_topology(mesh.triangles, mesh.vertices.size());
  if (!topology.manifold || !topology.closed || topology.components < 2) return false;
  const std::vector<Index> component = label_components(mesh.triangles, mesh.vertices.size());
  std::map<Triangle, std::vector<Index>> components;  // of the triangles with the same corners
  for (const Triangle& t : mesh.triangles) {
    Triangle corners{original[t[0]], original[t[1]], original[t[2]]};
    std::sort(corners.begin(), corners.end());
    components[corners].push_back(component[t[0]]);
  }
  std::set<Index> with_common, with_own;
  for (auto& [corners, of] : components) {
    std::sort(of.begin(), of.end());
    if (std::adjacent_find(of.begin(), of.end()) != of.end()) return false;
    (of.size() > 1 ? with_common : with_own).insert(of.begin(), of.end());
  }
  return !with_common.empty() &&
         std::includes(with_own.begin(), with_own.end(), with_common.begin(), with_common.end());
}

std::vector<std::array<Index, 2>> edges_after_halving(const std::vector<std::array<Index, 2>>& edges,
                                                      const std::vector<std::array<Index, 2>>& halved,
                                                      std::size_t count) {
  std::vector<std::array<Index, 2>> after;
  for (const auto& [a, b] : edges) {
    const auto at = std::lower_bound(halved.begin(), halved.end(), ascending(a, b));
    if (at == halved.end() || *at != ascending(a, b)) {
      after.push_back({a, b});
      continue;
    }
    const auto middle = static_cast<Index>(count - static_cast<std::size_t>(halved.end() - at));
    after.push_back({a, middle});
    after.push_back({middle, b});
  }
  return after;
}

std::vector<std::array<Index, 2>> edges_after_separating(const TriangleMesh& mesh, const std::vector<Index>& original,
                                                         const std::vector<std::array<Index, 2>>& edges) {
  std::set<std::array<Index, 2>> named, met, found;
  for (const auto& [a, b] : edges) named.insert(ascending(a, b));
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3 && !named.empty(); ++k) {
      const Index a = t[k], b = t[(k + 1) % 3];
      const std::array<Index, 2> before = ascending(original[a], original[b]);
      if (!named.contains(before)) continue;
      met.insert(before);
      found.insert(ascending(a, b));
    }
  for (const auto& edge : named)
    if (!met.contains(edge)) found.insert(edge);
  return {found.begin(), found.end()};
}

}  // namespace bisector
