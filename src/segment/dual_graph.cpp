#include "segment/dual_graph.h"

#include <algorithm>
#include <utility>

#include "core/geometry.h"
#include "core/grouping.h"
#include "mesh/topology.h"

namespace bisector {

namespace {

// The triangles at an edge, each once, ascending.
void triangles_at(const EdgeTable& table, std::size_t edge, std::vector<Index>& out) {
  out.clear();
  for (const std::size_t* h = table.half_edges.begin(edge); h != table.half_edges.end(edge); ++h) {
    const auto t = static_cast<Index>(*h / 3);
    if (out.empty() || out.back() != t) out.push_back(t);
  }
}

struct Neighbour {
  Index triangle;
  double length;
};

}  // namespace

DualGraph dual_graph(const std::vector<Triangle>& triangles, const std::vector<Vec3>& vertices) {
  const EdgeTable table = edge_table(triangles, vertices.size());
  const std::size_t n = triangles.size(), edges = table.edges.size();
  DualGraph graph;
  std::vector<double> length(edges);
  double sum = 0;
  for (std::size_t e = 0; e < edges; ++e) {
    const auto [a, b] = table.edges[e];
    length[e] = norm(vertices[b] - vertices[a]);
    sum += length[e];
  }
  graph.mean_edge_length = edges ? sum / static_cast<double>(edges) : 0;
  Csr<Neighbour> found = group_into_rows<Neighbour>(n, [&](const auto& put) {
    std::vector<Index> around;
    for (std::size_t e = 0; e < edges; ++e) {
      triangles_at(table, e, around);
      for (const Index t : around)
        for (const Index u : around)
          if (t != u) put(t, Neighbour{u, length[e]});
    }
  });

  graph.neighbours.offsets.reserve(n + 1);
  graph.neighbours.values.reserve(found.values.size());
  graph.edge_length.reserve(found.values.size());
  for (std::size_t t = 0; t < n; ++t) {
    Neighbour *const begin = found.values.data() + found.offsets[t], *const end =
                                                                         found.values.data() + found.offsets[t + 1];
    std::stable_sort(begin, end, [](const Neighbour& p, const Neighbour& q) { return p.triangle < q.triangle; });
    for (const Neighbour* it = begin; it != end; ++it) {
      if (it != begin && it->triangle == graph.neighbours.values.back()) {
        graph.edge_length.back() += it->length;
      } else {
        graph.neighbours.values.push_back(it->triangle);
        graph.edge_length.push_back(it->length);
      }
    }
    graph.neighbours.offsets.push_back(graph.neighbours.values.size());
  }
  return graph;
}

std::vector<Index> connected_parts(const DualGraph& graph, const std::vector<Index>& labels) {
  const std::size_t n = graph.neighbours.rows();
  std::vector<Index> part(n, kNone), stack;
  Index parts = 0;
  for (std::size_t first = 0; first < n; ++first) {
    if (part[first] != kNone) continue;
    part[first] = parts;
    stack.push_back(static_cast<Index>(first));
    while (!stack.empty()) {
      const Index t = stack.back();
      stack.pop_back();
      for (const Index* u = graph.neighbours.begin(t); u != graph.neighbours.end(t); ++u) {
        if (part[*u] != kNone || (!labels.empty() && labels[*u] != labels[t])) continue;
        part[*u] = parts;
        stack.push_back(*u);
      }
    }
    ++parts;
  }
  return part;
}

double border_length(const DualGraph& graph, const std::vector<Index>& labels) {
  double length = 0;
  for (std::size_t t = 0; t < graph.neighbours.rows(); ++t)
    for (std::size_t k = graph.neighbours.offsets[t]; k < graph.neighbours.offsets[t + 1]; ++k) {
      const Index u = graph.neighbours.values[k];
      if (t < u && labels[t] != labels[u]) length += graph.edge_length[k];
    }
  return length;
}

}  // namespace bisector
