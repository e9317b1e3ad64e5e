// What is known of a Voronoi diagram on a surface or in a solid, and which parts of it a caller asks for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bisector/cells.h"
#include "core/geometry.h"
#include "voronoi/moments.h"

namespace bisector {

// Integrals over the restricted or clipped cells; positions are relative to the seed.
struct CellMoments {
  std::vector<Moments> cells;  // by seed; zero for an empty cell
  // The mass, or a quarter of the median mass of the six nearest seeds where that is more: a scale for steps that does
  // not vanish with the cell.
  std::vector<double> step_mass;
  double mass = 0;    // sum over the cells
  double energy = 0;  // sum of the second moments: the CVT energy
  // Incident triangles of each cell, of the surface or the solid's boundary, ascending; where they were not wanted
  // there may be none.
  Csr<Index> triangles;
  std::uint64_t number = 0;  // by which a backend knows the diagram, if it keeps the triangles to itself
};

// How many pairs of a cell and a triangle or tetrahedron there are, and how many took more than the first attempt.
struct PairCounts {
  std::size_t pairs = 0;
  std::size_t uncertain = 0;  // settled in exact arithmetic
  std::size_t wider = 0;      // needed a longer list of neighbours

  // What a clipper has to say of its last pair.
  template <class AnyClipper>
  void add_doubts(const AnyClipper& clipper) {
    uncertain += clipper.uncertain();
    wider += clipper.wider();
  }
  PairCounts& operator+=(const PairCounts& b) {
    pairs += b.pairs;
    uncertain += b.uncertain;
    wider += b.wider;
    return *this;
  }
};

// What computing a diagram took, in seconds by phase.
struct DiagramWork {
  PairCounts counts;
  double delaunay = 0, neighbours = 0;  // lists of neighbours, by their source
  double owners = 0;                    // which cells the vertices lie in; for a solid all that concerns its boundary
  double clip = 0;                      // clipping and sums
};

// Parts of a diagram, as a set: Want::polygons | Want::dual. The moments are always part of it, without the incident
// triangles unless these are wanted; `labels` are the polygons without their vertices, and come with the triangles.
enum class Want : unsigned { moments = 0, triangles = 1, labels = 3, polygons = 7, polyhedra = 8, dual = 16 };

constexpr Want operator|(Want a, Want b) {
  return static_cast<Want>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}
constexpr Want operator&(Want a, Want b) {
  return static_cast<Want>(static_cast<unsigned>(a) & static_cast<unsigned>(b));
}
constexpr bool includes(Want set, Want parts) { return (set & parts) == parts; }

// The diagram of some seeds. Parts that were not asked for are empty.
struct Diagram {
  CellMoments moments;
  RestrictedPolygons polygons;  // of the surface, or of the solid's boundary
  ClippedPolyhedra polyhedra;   // of a solid only
  Dual dual;                    // of the surface, or of the solid's boundary; comes with the labels it is read off
  Want has = Want::moments;     // which parts are there
};

}  // namespace bisector
