// Edges and components of triangle meshes.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "bisector/mesh.h"
#include "bisector/quality.h"
#include "core/parallel.h"

namespace bisector {

// An edge with its lower vertex first.
inline std::array<Index, 2> sorted_edge(Index a, Index b) { return a < b ? std::array{a, b} : std::array{b, a}; }

// The undirected edges in lexicographic order. Half-edge 3 t + k runs from corner k of triangle t to the next corner.
struct EdgeTable {
  std::vector<std::array<Index, 2>> edges;  // lower vertex first
  Csr<std::size_t> half_edges;              // of each edge, ascending
};
EdgeTable edge_table(const std::vector<Triangle>& triangles, std::size_t vertex_count);

// A half-edge at its edge's lower vertex.
struct EdgeSide {
  Index high;  // the higher vertex
  Index half_edge;
};
// Those of each vertex, by edges, then half-edges: what an EdgeTable is made of, in a third of its memory.
Csr<EdgeSide> edge_sides(const std::vector<Triangle>& triangles, std::size_t vertex_count);
// Calls visit(sides) for the sides of each edge, in parallel.
template <class Visit>
void each_edge(const Csr<EdgeSide>& sides, const Visit& visit) {
  constexpr std::size_t kVerticesAtOnce = 4096;
  parallel_each(
      sides.rows(),
      [&](std::size_t v) {
        const EdgeSide* const end = sides.end(v);
        for (const EdgeSide *first = sides.begin(v), *last = first; first != end; first = last) {
          while (last != end && last->high == first->high) ++last;
          visit(std::span<const EdgeSide>(first, last));
        }
      },
      kVerticesAtOnce);
}

// The same for triangles whose edges are known. There are some.
MeshTopology analyse_topology(const std::vector<Triangle>& triangles, std::size_t vertex_count, const EdgeTable& table);

// What orient() does, for triangles whose edges are known; true if it turned any. Half-edges of those that it turned
// are others then.
bool orient(std::vector<Triangle>& triangles, const EdgeTable& table);

// For each vertex whether its triangles hang together through its edges in more than one fan.
std::vector<char> split_vertices(const std::vector<Triangle>& triangles, std::size_t vertex_count);

// The vertices at the other ends of each vertex's edges, ascending.
Csr<Index> vertex_neighbours(const std::vector<Triangle>& triangles, std::size_t vertex_count);

// Which edges of a triangle, k from corner k to the next, are among these, which are sorted, each with its lower vertex
// first.
std::array<bool, 3> edges_among(const Triangle& t, const std::vector<std::array<Index, 2>>& edges);

// The component of each vertex, connected through triangles, numbered from 0 by lowest vertex; kNone for vertices that
// no triangle uses.
std::vector<Index> label_components(const std::vector<Triangle>& triangles, std::size_t vertex_count);

}  // namespace bisector
