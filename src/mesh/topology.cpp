#include "mesh/topology.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <numeric>
#include <utility>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "bisector/repair.h"
#include "core/disjoint_sets.h"
#include "core/grouping.h"
#include "core/parallel.h"
#include "mesh/half_edges.h"

namespace bisector {

namespace {

constexpr std::size_t kVerticesAtOnce = 4096, kEdgesAtOnce = 16384;  // of a parallel loop

// A side of a triangle at a vertex.
struct Spoke {
  Index to;              // the other vertex
  std::size_t triangle;  // which of those around the vertex
};

// Whether the triangles around a vertex, linked through the edges that they share there, fall apart. Each has two of
// the spokes.
bool fall_apart(std::vector<Spoke>& spokes) {
  std::size_t parts = spokes.size() / 2;
  DisjointSets<> fans(parts);
  std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) { return a.to < b.to; });
  for (std::size_t k = 1; k < spokes.size(); ++k)
    if (spokes[k].to == spokes[k - 1].to && fans.join(spokes[k].triangle, spokes[k - 1].triangle)) --parts;
  return parts > 1;
}

// Calls visit(vertex, spokes) for every vertex, in parallel. It may change the spokes.
template <class Visit>
void each_vertex(const std::vector<Triangle>& triangles, std::size_t vertex_count, const Visit& visit) {
  const Csr<std::size_t> corners = scatter_into_rows<std::size_t>(
      vertex_count, 3 * triangles.size(), [&](std::size_t h) { return origin(triangles, h); },
      [](std::size_t h) { return h; });
  parallel_chunks(vertex_count, kVerticesAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::vector<Spoke> spokes;
    for (std::size_t v = begin; v < end; ++v) {
      spokes.clear();
      for (const std::size_t* h = corners.begin(v); h != corners.end(v); ++h)
        for (const std::size_t other : {next_half_edge(*h), next_half_edge(next_half_edge(*h))})
          spokes.push_back({origin(triangles, other), static_cast<std::size_t>(h - corners.begin(v))});
      visit(v, spokes);
    }
  });
}

// Whether the triangles of every edge of two run along it in opposite directions.
bool are_coherent(const std::vector<Triangle>& triangles, const EdgeTable& table) {
  std::atomic<bool> coherent{true};
  parallel_chunks(table.edges.size(), kEdgesAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      const std::size_t* sides = table.half_edges.begin(e);
      if (table.half_edges.size(e) == 2 && origin(triangles, sides[0]) == origin(triangles, sides[1])) coherent = false;
    }
  });
  return coherent;
}

}  // namespace

std::vector<char> split_vertices(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  std::vector<char> split(vertex_count, 0);
  each_vertex(triangles, vertex_count,
              [&](std::size_t v, std::vector<Spoke>& spokes) { split[v] = fall_apart(spokes); });
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

Csr<EdgeSide> edge_sides(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  const std::size_t n = 3 * triangles.size();
  if (n > std::numeric_limits<Index>::max())
    throw Error(fmt::format("{} triangles are too many; at most {} can be indexed", triangles.size(),
                            std::numeric_limits<Index>::max() / 3));
  const auto ends = [&](std::size_t h) {
    return ascending(origin(triangles, h), origin(triangles, next_half_edge(h)));
  };
  Csr<EdgeSide> sides = scatter_into_rows<EdgeSide>(
      vertex_count, n, [&](std::size_t h) { return ends(h)[0]; },
      [&](std::size_t h) {
        return EdgeSide{ends(h)[1], static_cast<Index>(h)};
      });
  EdgeSide* const all = sides.values.data();
  parallel_each(
      vertex_count,
      [&](std::size_t v) {
        std::sort(all + sides.offsets[v], all + sides.offsets[v + 1], [](const EdgeSide& x, const EdgeSide& y) {
          return x.high != y.high ? x.high < y.high : x.half_edge < y.half_edge;
        });
      },
      kVerticesAtOnce);
  return sides;
}

EdgeTable edge_table(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  const Csr<EdgeSide> records = edge_sides(triangles, vertex_count);
  const std::size_t n = records.values.size();
  const auto is_first = [&](std::size_t row, std::size_t k) {
    return k == records.offsets[row] || records.values[k].high != records.values[k - 1].high;
  };
  std::vector<std::size_t> first((vertex_count + kVerticesAtOnce - 1) / kVerticesAtOnce + 1, 0);  // edge of each block
  parallel_chunks(vertex_count, kVerticesAtOnce, [&](std::size_t block, std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v)
      for (std::size_t k = records.offsets[v]; k < records.offsets[v + 1]; ++k) first[block + 1] += is_first(v, k);
  });
  std::partial_sum(first.begin(), first.end(), first.begin());
  EdgeTable table;
  table.edges.resize(first.back());
  table.half_edges.offsets.resize(first.back() + 1);
  table.half_edges.offsets.back() = n;
  table.half_edges.values.resize(n);
  parallel_chunks(vertex_count, kVerticesAtOnce, [&](std::size_t block, std::size_t begin, std::size_t end) {
    std::size_t edge = first[block];
    for (std::size_t v = begin; v < end; ++v)
      for (std::size_t k = records.offsets[v]; k < records.offsets[v + 1]; ++k) {
        if (is_first(v, k)) {
          table.edges[edge] = {static_cast<Index>(v), records.values[k].high};
          table.half_edges.offsets[edge++] = k;
        }
        table.half_edges.values[k] = records.values[k].half_edge;
      }
  });
  return table;
}

MeshTopology analyse_topology(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  return triangles.empty() ? MeshTopology{}
                           : analyse_topology(triangles, vertex_count, edge_table(triangles, vertex_count));
}

MeshTopology analyse_topology(const std::vector<Triangle>& triangles, std::size_t vertex_count,
                              const EdgeTable& table) {
  MeshTopology topology;
  topology.oriented = are_coherent(triangles, table);
  ConcurrentSets<Index> parts(vertex_count);
  std::atomic<std::size_t> joined{0}, of_one{0}, of_many{0};
  parallel_chunks(table.edges.size(), kEdgesAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::size_t joins = 0, ones = 0, many = 0;
    for (std::size_t e = begin; e < end; ++e) {
      const auto [a, b] = table.edges[e];
      const std::size_t count = table.half_edges.size(e);
      joins += parts.join(a, b);
      ones += count == 1;
      many += count > 2 || a == b;
    }
    joined += joins;
    of_one += ones;
    of_many += many;
  });
  enum : char { unused, whole, split };
  std::vector<char> kinds(vertex_count, unused);
  each_vertex(triangles, vertex_count, [&](std::size_t v, std::vector<Spoke>& spokes) {
    if (!spokes.empty()) kinds[v] = fall_apart(spokes) ? split : whole;
  });
  const auto count_of = [&](char kind) { return static_cast<std::size_t>(std::ranges::count(kinds, kind)); };
  const std::size_t used = vertex_count - count_of(unused);
  topology.boundary_edges = of_one;
  topology.non_manifold_edges = of_many;
  topology.non_manifold_vertices = count_of(split);
  topology.closed = topology.boundary_edges == 0;
  topology.manifold = topology.non_manifold_edges == 0 && topology.non_manifold_vertices == 0;
  topology.components = used - joined;
  topology.euler = static_cast<long long>(used) - static_cast<long long>(table.edges.size()) +
                   static_cast<long long>(triangles.size());
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
  orient(triangles, edge_table(triangles, vertex_count));
}

bool orient(std::vector<Triangle>& triangles, const EdgeTable& table) {
  if (are_coherent(triangles, table)) return false;
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
  return true;
}

}  // namespace bisector
