#include "mesh/topology.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "bisector/quality.h"
#include "bisector/repair.h"
#include "core/disjoint_sets.h"
#include "core/grouping.h"
#include "mesh/half_edges.h"

namespace bisector {

namespace {

// Links the corners (3 t + k) at both ends of an edge over all its triangles.
void join_fans(const std::vector<Triangle>& triangles, const EdgeTable& table, std::size_t edge, DisjointSets<>& fans) {
  const std::size_t* sides = table.half_edges.begin(edge);
  for (std::size_t s = 1; s < table.half_edges.size(edge); ++s)
    for (const Index v : table.edges[edge])
      fans.join(corner_at(triangles, sides[0], v), corner_at(triangles, sides[s], v));
}

}  // namespace

std::vector<char> split_vertices(const std::vector<Triangle>& triangles, std::size_t vertex_count,
                                 const EdgeTable& table) {
  DisjointSets<> fans(3 * triangles.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e) join_fans(triangles, table, e, fans);
  constexpr std::size_t kUnseen = static_cast<std::size_t>(-1);
  std::vector<std::size_t> fan(vertex_count, kUnseen);
  std::vector<char> split(vertex_count, 0);
  for (std::size_t corner = 0; corner < 3 * triangles.size(); ++corner) {
    const Index v = origin(triangles, corner);
    const std::size_t root = fans.root(corner);
    if (fan[v] == kUnseen) fan[v] = root;
    if (fan[v] != root) split[v] = 1;
  }
  return split;
}

Csr<Index> vertex_neighbours(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  const EdgeTable table = edge_table(triangles, vertex_count);
  // The edges are in ascending order, and so are the neighbours of each vertex then.
  return group_into_rows<Index>(vertex_count, [&](const auto& put) {
    for (const auto& [a, b] : table.edges) {
      put(a, b);
      put(b, a);
    }
  });
}

std::array<bool, 3> edges_among(const Triangle& t, const std::vector<std::array<Index, 2>>& edges) {
  std::array<bool, 3> among{};
  for (int k = 0; k < 3 && !edges.empty(); ++k) {
    const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
    among[k] = std::binary_search(edges.begin(), edges.end(), std::array<Index, 2>{a, b});
  }
  return among;
}

EdgeTable edge_table(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  using Record = std::pair<Index, std::size_t>;  // the edge's higher vertex, half-edge
  const std::size_t n = 3 * triangles.size();
  const auto ends = [&](std::size_t h) {
    return std::minmax({origin(triangles, h), origin(triangles, next_half_edge(h))});
  };

  Csr<Record> records = group_into_rows<Record>(vertex_count, [&](const auto& put) {
    for (std::size_t h = 0; h < n; ++h) {
      const auto [low, high] = ends(h);
      put(low, Record{high, h});
    }
  });

  EdgeTable table;
  table.edges.reserve(n / 2);
  table.half_edges.offsets.reserve(n / 2 + 1);
  table.half_edges.values.reserve(n);
  for (std::size_t v = 0; v < vertex_count; ++v) {
    Record* const begin = records.values.data() + records.offsets[v];
    Record* const end = records.values.data() + records.offsets[v + 1];
    std::sort(begin, end);
    for (const Record* record = begin; record != end; ++record) {
      if (record == begin || record->first != record[-1].first) {
        if (!table.edges.empty()) table.half_edges.offsets.push_back(table.half_edges.values.size());
        table.edges.push_back({static_cast<Index>(v), record->first});
      }
      table.half_edges.values.push_back(record->second);
    }
  }
  if (!table.edges.empty()) table.half_edges.offsets.push_back(table.half_edges.values.size());
  return table;
}

MeshTopology analyse_topology(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  if (triangles.empty()) return {};
  const EdgeTable table = edge_table(triangles, vertex_count);
  MeshTopology topology;
  topology.oriented = true;
  DisjointSets<> parts(vertex_count);
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    const auto [a, b] = table.edges[e];
    const std::size_t* sides = table.half_edges.begin(e);
    const std::size_t count = table.half_edges.size(e);
    parts.join(a, b);
    if (count == 1) ++topology.boundary_edges;
    if (count > 2 || a == b) ++topology.non_manifold_edges;
    if (count == 2 && origin(triangles, sides[0]) == origin(triangles, sides[1])) topology.oriented = false;
  }
  const std::vector<char> split = split_vertices(triangles, vertex_count, table);
  topology.non_manifold_vertices = static_cast<std::size_t>(std::count(split.begin(), split.end(), 1));
  topology.closed = topology.boundary_edges == 0;
  topology.manifold = topology.non_manifold_edges == 0 && topology.non_manifold_vertices == 0;

  std::vector<char> used(vertex_count, 0);
  for (const Triangle& t : triangles)
    for (const Index v : t) used[v] = 1;
  long long vertices = 0;
  for (std::size_t v = 0; v < vertex_count; ++v) {
    if (!used[v]) continue;
    ++vertices;
    if (parts.root(v) == v) ++topology.components;
  }
  topology.euler = vertices - static_cast<long long>(table.edges.size()) + static_cast<long long>(triangles.size());
  return topology;
}

std::vector<Index> label_components(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  DisjointSets<> sets(vertex_count);
  std::vector<Index> label(vertex_count, kNone);
  for (const Triangle& t : triangles)
    for (int k = 0; k < 3; ++k) {
      sets.join(t[0], t[k]);
      label[t[k]] = 0;
    }
  std::vector<Index> of_root(vertex_count, kNone);
  Index count = 0;
  for (std::size_t v = 0; v < vertex_count; ++v) {
    if (label[v] == kNone) continue;
    Index& component = of_root[sets.root(v)];
    if (component == kNone) component = count++;
    label[v] = component;
  }
  return label;
}

void orient(std::vector<Triangle>& triangles, std::size_t vertex_count) {
  const EdgeTable table = edge_table(triangles, vertex_count);
  std::vector<std::size_t> edge_of(3 * triangles.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e)
    for (const std::size_t* h = table.half_edges.begin(e); h != table.half_edges.end(e); ++h) edge_of[*h] = e;
  enum : char { unseen, kept, turned };
  std::vector<char> state(triangles.size(), unseen);
  for (std::size_t start = 0; start < triangles.size(); ++start) {
    if (state[start] != unseen) continue;
    std::vector<std::size_t> part{start};
    state[start] = kept;
    std::size_t turns = 0;
    for (std::size_t head = 0; head < part.size(); ++head)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t h = 3 * part[head] + k, e = edge_of[h];
        if (table.half_edges.size(e) != 2) continue;
        const std::size_t* sides = table.half_edges.begin(e);
        const std::size_t other = sides[0] == h ? sides[1] : sides[0], t = other / 3;
        if (state[t] != unseen) continue;
        const bool agree = origin(triangles, h) != origin(triangles, other);
        state[t] = agree == (state[part[head]] == kept) ? kept : turned;
        turns += state[t] == turned;
        part.push_back(t);
      }
    if (2 * turns > part.size())
      for (std::size_t t : part) state[t] = state[t] == kept ? turned : kept;
  }
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (state[t] == turned) std::swap(triangles[t][1], triangles[t][2]);
}

}  // namespace bisector
