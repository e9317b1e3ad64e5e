// Clipped Voronoi diagrams of solids: exact combinatorics, closed-form moments (thesis 5.4).
//
// The diagram is that of exact arithmetic on the given coordinates, made unique by simulation of simplicity (exact.h):
// it depends on the seeds and the solid alone, not on the source of neighbours, the clipping order or the number of
// threads.
#pragma once

#include <memory>
#include <vector>

#include "core/geometry.h"
#include "voronoi/diagram.h"
#include "voronoi/neighbours.h"
#include "voronoi/restricted.h"
#include "voronoi/solid.h"

namespace bisector {

// How cells are treated.
enum class SolidCells {
  whole,    // as wholes, without regard to the tetrahedra: by the polygons in which they meet the boundary and their
            // Voronoi vertices inside; only where the density is uniform
  clipped,  // cut up by the tetrahedra
};

class ClippedVoronoi {
 public:
  // The solid must outlive the object. SolidCells::whole is only heeded where the density is uniform.
  explicit ClippedVoronoi(const Solid& solid, SolidCells how = SolidCells::whole);
  ~ClippedVoronoi();

  // Sets the moments of every cell in the solid, zero for a seed whose cell lies outside, and of the polygons of the
  // boundary and the polyhedra what is wanted. `moments.triangles` are the incident boundary triangles of each cell:
  // seeds with any are boundary seeds. Between calls memory is kept, and the last diagram serves for first guesses.
  DiagramWork evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, Want want, Diagram& diagram);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

// The dual tetrahedra: sets of four seeds whose cells meet in a vertex inside the solid, each ascending, sorted,
// without repetition.
std::vector<Tetrahedron> dual_tets(const ClippedPolyhedra& polyhedra);

// The certificate of a reported diagram. Where cells are cut up, each inner facet {i, j} of each tetrahedron must occur
// once in cell i and once in j with the same vertices, and each facet of the tetrahedron must be tiled as from its
// other side. Of whole cells each bisector must be one of its two cells', and each vertex one of its four. Returns the
// number of tetrahedra and whole cells where that fails; the boundary's polygons have a certificate of their own.
std::size_t count_untiled(const Solid& solid, const ClippedPolyhedra& polyhedra);

}  // namespace bisector
