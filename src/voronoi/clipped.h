// Clipped Voronoi diagrams of solids: exact combinatorics, closed-form moments (thesis 5.4).
//
// The diagram is that of exact arithmetic on the given coordinates, made unique by simulation of simplicity (exact.h): it
// depends on the seeds and the solid alone, not on the source of neighbours, the clipping order or the number of threads.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/geometry.h"
#include "voronoi/neighbours.h"
#include "voronoi/restricted.h"
#include "voronoi/solid.h"

namespace bisector {

// What a polyhedron's facet lies on: a seed (its bisector with the cell's own), or facet k of the tetrahedron.
inline constexpr Index kFacetLabel = 0x80000000u;
inline bool is_facet(Index label) { return label & kFacetLabel; }

// How cells that do not meet the boundary are treated.
enum class InnerCells {
  whole,    // taken whole, without regard to the tetrahedra, once they are proven to lie inside; only where the density is uniform
  clipped,  // cut up like the others
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

class ClippedVoronoi {
 public:
  // The solid must outlive the object. InnerCells::whole is only heeded where the density is uniform.
  explicit ClippedVoronoi(const Solid& solid, InnerCells inner = InnerCells::whole);
  ~ClippedVoronoi();

  // The moments of every cell in the solid; zero for a seed whose cell lies outside. `result.triangles` are the incident
  // boundary triangles of each cell: seeds with any are boundary seeds. Between calls memory is kept, and the last diagram serves
  // for first guesses.
  void evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, CellMoments& result);
  // The same, and the polygons of cells and boundary.
  void evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, CellMoments& result, RestrictedPolygons& polygons);
  // The same, and the polyhedra of cells and tetrahedra.
  void evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, CellMoments& result, RestrictedPolygons& polygons,
                ClippedPolyhedra& polyhedra);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

// The dual tetrahedra: sets of four seeds whose cells meet in a vertex inside the solid, each ascending, sorted, without
// repetition.
std::vector<Tetrahedron> dual_tets(const ClippedPolyhedra& polyhedra);

// The certificate of a reported diagram. On each tetrahedron each inner facet {i, j} must occur once in cell i and once in j with
// the same vertices, each facet of the tetrahedron must be tiled as from its other side, and every bisector facet of a cell
// taken whole must have a counterpart. Returns the number of tetrahedra and whole cells where that fails.
std::size_t count_untiled(const Solid& solid, const ClippedPolyhedra& polyhedra);

}  // namespace bisector
