// What is known of a Voronoi diagram on a surface or in a solid, and which parts of it a caller asks for.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bisector/device.h"
#include "core/geometry.h"
#include "voronoi/moments.h"
#include "voronoi/surface.h"

namespace bisector {

// What a polyhedron's facet lies on: a seed (its bisector with the cell's own), or facet k of the tetrahedron.
inline constexpr Index kFacetLabel = 0x80000000u;
inline bool is_facet(Index label) { return label & kFacetLabel; }

// Integrals over the restricted or clipped cells; positions are relative to the seed.
struct CellMoments {
  std::vector<Moments> cells;      // by seed; zero for an empty cell
  // The mass, or a quarter of the median mass of the six nearest seeds where that is more: a scale for steps that does
  // not vanish with the cell.
  std::vector<double> step_mass;
  double mass = 0;                 // sum over the cells
  double energy = 0;               // sum of the second moments: the CVT energy
  Csr<Index> triangles;            // incident triangles of each cell, of the surface or the solid's boundary, ascending
  Certification certification;
  DiagramSeconds seconds;
};

// The non-empty intersections of cells and triangles, sorted by (triangle, cell).
struct RestrictedPolygons {
  struct Pair {
    Index triangle, cell;
  };
  std::vector<Pair> pairs;
  std::vector<std::size_t> offsets{0};  // polygon k has the entries offsets[k] .. offsets[k + 1)
  // Entry e: the counter-clockwise polygon's vertex and the label of the edge that starts there. The vertex is where the
  // preceding label and this one meet.
  std::vector<Index> labels;
  std::vector<Vec3> vertices;
};

// The non-empty intersections of cells and tetrahedra, sorted by (tetrahedron, cell); inner cells taken whole have the
// tetrahedron kNone and come last. A polyhedron is kept in dual form: the labels of its facets, ascending (facets of the
// tetrahedron after seeds), and its vertices as triples of positions in that list.
struct ClippedPolyhedra {
  struct Pair {
    Index tet, cell;
  };
  std::vector<Pair> pairs;
  std::vector<std::size_t> label_offsets{0};   // of pair k: label_offsets[k] .. label_offsets[k + 1)
  std::vector<Index> labels;
  std::vector<std::size_t> vertex_offsets{0};  // likewise
  // The three planes of a vertex, counter-clockwise around it seen from outside, the first the least; sorted in each pair.
  std::vector<std::array<std::uint16_t, 3>> triples;
  std::vector<Vec3> vertices;                  // where the planes of each triple meet
};

// The restricted Delaunay triangulation.
struct Dual {
  // Triples of cells that share a vertex of the diagram, each oriented as the surface at its first such vertex. Sorted as
  // ascending triples, without repeats.
  std::vector<Triangle> triangles;
  // How many vertices of the diagram each triple has; 1 where the topological ball property holds.
  std::vector<Index> multiplicity;
  std::vector<Index> mesh_triangle;  // in which its first such vertex lies
};

// Parts of a diagram, as a set: Want::polygons | Want::dual. The moments are always part of it.
enum class Want : unsigned { moments = 0, polygons = 1, polyhedra = 2, dual = 4 };

constexpr Want operator|(Want a, Want b) { return static_cast<Want>(static_cast<unsigned>(a) | static_cast<unsigned>(b)); }
constexpr Want operator&(Want a, Want b) { return static_cast<Want>(static_cast<unsigned>(a) & static_cast<unsigned>(b)); }
constexpr bool includes(Want set, Want parts) { return (set & parts) == parts; }

// The diagram of some seeds. Parts that were not asked for are empty.
struct Diagram {
  CellMoments moments;
  RestrictedPolygons polygons;  // of the surface, or of the solid's boundary
  ClippedPolyhedra polyhedra;   // of a solid only
  Dual dual;                    // of the surface, or of the solid's boundary; comes with the polygons it is read off
  Want has = Want::moments;     // which parts are there
};

}  // namespace bisector
