// The part of a Voronoi cell within a closed surface, from the polygons in which the cell meets the surface and the
// cell's own Voronoi vertices, by the divergence theorem: what fills the surface need not be cut up.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bisector/cells.h"
#include "core/geometry.h"
#include "core/marks.h"
#include "voronoi/cell_polygon.h"
#include "voronoi/clip.h"
#include "voronoi/clip_tet.h"
#include "voronoi/fixed_tree_sum.h"
#include "voronoi/moments.h"
#include "voronoi/surface.h"

namespace bisector {

// Integrates over boundary cells. One object per thread; memory is kept between calls.
//
// A Voronoi edge leaves the inside where a polygon's corner lies between its two bisectors in one order, and enters it
// where they come in the other. So the corners on an edge tell which of its two ends, the Voronoi vertices, lie inside,
// and along the edges what is known of one vertex is known of all. The cell's faces are then bounded by edges of
// polygons and by what lies between corners and inner vertices on Voronoi edges. No order of the corners on an edge is
// needed, for integrals along it are differences.
//
// Voronoi vertices come from a list of neighbours that need not be complete. Seeds that it lacks can only cut off what
// lies outside, if it has all those that bound polygons and if it reaches twice as far as every vertex that is held to
// be inside: a face of a seed that is not listed meets no polygon, so all of it is on one side; were that the inside, a
// Voronoi edge between listed seeds would lead from it to a vertex that is held to be inside and is not certain. Only
// if the cell has no edge between listed seeds there is none; it has one if some edge is crossed more often one way
// than the other, or if some vertex is certain.
class BoundaryCell {
 public:
  // On which side of the surface the Voronoi vertices of a cell lie where its polygons do not tell.
  enum class Side { unknown, inside, outside };

  // The surface and the tetrahedron that holds it must outlive the object.
  BoundaryCell(const Surface& surface, const TetFrame& enclosure) : surface_(surface), enclosure_(enclosure) {}

  // Forgets what is kept about the seeds; to be called whenever they or their neighbours change.
  void reset(const SortedSeeds& seeds, const Neighbours& neighbours);

  // Sets the moments of the cell, whose polygons are given in ascending order of triangles. Throws Error if they cannot
  // be those of a surface that bounds a solid. False if the polygons do not tell on which side of the surface the
  // cell's Voronoi vertices lie, which then is the same for all of them and can be given as `vertices`.
  bool integrate(Index slot, std::span<const CellPolygon> polygons, Side vertices = Side::unknown);

  // About the seed, with density 1. Zero where the volume is less than its rounding error.
  const Moments& moments() const { return moments_; }
  // The neighbours that share a Voronoi vertex inside with the cell.
  const std::vector<Index>& reached() const { return reached_; }
  // Appends what the cell's polygons leave of its boundary: the bisectors that bound it inside the surface, and the
  // Voronoi vertices there.
  void append_polyhedron(ClippedPolyhedra& polyhedra);
  // Whether a decision of the last call was uncertain, or its list too short.
  bool uncertain() const { return uncertain_; }
  bool wider() const { return wider_; }

 private:
  // A polygon's corner on the Voronoi edge of two neighbours, named by their indices, the lower first.
  struct Crossing {
    std::uint64_t edge;
    Index order;  // by triangle
    int sign;     // 1 where the edge leaves the inside along the cross product of the vectors to the two, else -1
    Vec3 at;
  };
  struct Term {
    std::uint64_t edge;
    Moments moments;
  };
  enum class Found { settled, open, uncertain };

  std::uint64_t edge_of(Index a, Index b) const;
  void trace(std::span<const CellPolygon> polygons);
  void trace_polygon(const CellPolygon& polygon, Moments& sum);
  Found find_sides(Side vertices);
  void list_reached();
  bool lists_bisectors();
  void count_crossings();
  bool propagate();
  Moments edge_moments(Index from, Index to, Index first, Index second, std::size_t crossing) const;
  void add_edges();
  void add(const Moments& cone, const Moments& edges);

  const Surface& surface_;
  const TetFrame& enclosure_;
  const SortedSeeds* seeds_ = nullptr;
  Clipper polygons_;
  TetClipper cell_;
  Vec3 seed_;

  Index slot_ = 0;
  std::vector<Index> bisectors_;     // of polygon edges, some more than once
  std::vector<Crossing> crossings_;  // by edge, then by triangle
  FixedTreeSum sum_;
  double magnitude_ = 0;  // of the volumes added

  Marks crossed_;  // bisectors with crossings
  Marks listed_, met_;
  // Of each vertex and plane: the first of its crossings on the edge that leaves the plane there, and how many more
  // leave the inside towards the vertex than enter it.
  struct Edge {
    std::size_t first;
    int net;
  };
  std::vector<Edge> edges_;
  std::vector<int> level_;  // of each vertex, up to a constant: 1 more inside than outside
  std::vector<Index> queue_;
  std::vector<char> inside_;  // of each vertex
  std::vector<Term> terms_;

  Moments moments_;
  std::vector<Index> reached_;
  std::vector<Index> labels_, place_;  // for append_polyhedron(): slots, and of each slot its place among them
  bool uncertain_ = false, wider_ = false;
};

}  // namespace bisector
