// Combinatorial facts of a triangle mesh: manifold, closed, oriented, Euler characteristic, components.
#pragma once

#include <array>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct MeshTopology {
  bool manifold = false;       // every edge has one or two triangles and every vertex one fan or disk of them
  bool closed = false;         // every edge has at least two triangles
  bool oriented = false;       // across every edge of two triangles they run in opposite directions
  long long euler = 0;         // V - E + F over the vertices that triangles use
  std::size_t components = 0;  // connected through vertices
  std::size_t boundary_edges = 0;
  std::size_t non_manifold_edges = 0;     // of more than two triangles, or from a vertex to itself
  std::size_t non_manifold_vertices = 0;  // whose triangles, linked through edges, fall apart into several fans
};

// All false and 0 if there are no triangles. Every index must be below `vertex_count`.
MeshTopology analyse_topology(const std::vector<Triangle>& triangles, std::size_t vertex_count);

// Turns triangles over so that neighbours across edges of two triangles run in opposite directions there, wherever that can
// be had; each part that hangs together in this way keeps the orientation of most of its triangles.
void orient(std::vector<Triangle>& triangles, std::size_t vertex_count);

// The undirected edges in lexicographic order. Half-edge 3 t + k runs from corner k of triangle t to the next corner.
struct EdgeTable {
  std::vector<std::array<Index, 2>> edges;  // lower vertex first
  Csr<std::size_t> half_edges;              // of each edge, ascending
};
EdgeTable edge_table(const std::vector<Triangle>& triangles, std::size_t vertex_count);

// The component of each vertex, connected through triangles, numbered from 0 by lowest vertex; kNone for vertices that no
// triangle uses.
std::vector<Index> label_components(const std::vector<Triangle>& triangles, std::size_t vertex_count);

}  // namespace bisector
