// Restricted Voronoi diagrams of surfaces: exact combinatorics, closed-form moments (thesis 4.3, 5.4.2).
//
// The diagram is that of exact arithmetic on the given coordinates, made unique by simulation of simplicity (see
// exact.h): it depends on the seeds and the mesh alone, not on the source of neighbours, the clipping order or the
// number of threads.
#pragma once

#include <memory>
#include <vector>

#include "bisector/cells.h"
#include "core/geometry.h"
#include "voronoi/cell_polygon.h"
#include "voronoi/diagram.h"
#include "voronoi/neighbours.h"
#include "voronoi/surface.h"

namespace bisector {

class RestrictedVoronoi {
 public:
  // The surface must outlive the object.
  explicit RestrictedVoronoi(const Surface& surface, ListLength lists = {});
  ~RestrictedVoronoi();

  // Sets the moments of every cell, and the polygons if they are wanted. Between calls memory is kept, and the owners
  // of the last diagram serve as first guesses.
  DiagramWork evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, Want want, Diagram& diagram);
  // Only who meets whom: of the moments the `triangles`, and the polygons if they are wanted.
  DiagramWork trace(const std::vector<Vec3>& seeds, NeighbourSource source, Want want, Diagram& diagram);

  // Of the last diagram.
  // The polygons of a cell, in ascending order of triangles.
  void polygons_of(Index slot, std::vector<CellPolygon>& polygons) const;
  const SortedSeeds& seeds() const;
  const Neighbours& neighbours() const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace bisector
