// The cells of a Voronoi diagram cut up by the triangles or tetrahedra of its domain, and the dual triangles: plain
// data.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

enum class NeighbourSource {
  nearest,   // nearest seeds by distance, grown where they prove too few
  delaunay,  // Delaunay 1-ring; falls back to `nearest` for seeds in a plane
};

// Labels of polygon edges: a seed (the edge is shared with its cell), or edge k of the triangle, from corner k to
// corner k + 1.
inline constexpr Index kEdgeLabel = 0x80000000u;
inline bool is_edge(Index label) { return label & kEdgeLabel; }

// Labels of polyhedron facets: a seed, or facet k of the tetrahedron, opposite corner k.
inline constexpr Index kFacetLabel = 0x80000000u;
inline bool is_facet(Index label) { return label & kFacetLabel; }

// The non-empty intersections of cells and triangles, sorted by (triangle, cell).
struct RestrictedPolygons {
  struct Pair {
    Index triangle, cell;
  };
  std::vector<Pair> pairs;
  std::vector<std::size_t> offsets{0};  // polygon k has the entries offsets[k] .. offsets[k + 1)
  // Entry e: the counter-clockwise polygon's vertex and the label of the edge that starts there. The vertex is where
  // the preceding label and this one meet.
  std::vector<Index> labels;
  std::vector<Vec3> vertices;
};

// The non-empty intersections of cells and tetrahedra, sorted by (tetrahedron, cell). A polyhedron is kept in dual
// form: the labels of its facets, ascending (facets of the tetrahedron after seeds), and its vertices as triples of
// positions in that list. Where the density is uniform, cells are not cut up by tetrahedra: each is one polyhedron with
// the tetrahedron kNone. Of a cell that meets the boundary it has the bisectors that bound it inside the solid and the
// Voronoi vertices there; the rest of its surface are the cell's polygons on the boundary.
struct ClippedPolyhedra {
  struct Pair {
    Index tet, cell;
  };
  std::vector<Pair> pairs;
  std::vector<std::size_t> label_offsets{0};  // of pair k: label_offsets[k] .. label_offsets[k + 1)
  std::vector<Index> labels;
  std::vector<std::size_t> vertex_offsets{0};  // likewise
  // The three planes of a vertex, counter-clockwise around it seen from outside, the first the least; sorted in each
  // pair.
  std::vector<std::array<std::uint16_t, 3>> triples;
  std::vector<Vec3> vertices;  // where the planes of each triple meet
};

// The restricted Delaunay triangulation.
struct Dual {
  // Triples of seeds whose cells share a vertex of the diagram, each oriented as the surface at its first such vertex.
  // Sorted as ascending triples, without repeats.
  std::vector<Triangle> triangles;
  // How many vertices of the diagram each triple has; 1 where the topological ball property holds.
  std::vector<Index> multiplicity;
  std::vector<Index> mesh_triangle;  // in which its first such vertex lies
};

}  // namespace bisector
