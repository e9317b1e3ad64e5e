// Boundary cells of a uniform solid, from the polygons that the device has found: on the CPU, in double, with the code
// of ClippedVoronoi, so that they are the CPU's bit for bit. They are as many as a surface has, not a solid.
#pragma once

#include <vector>

#include "core/parallel.h"
#include "voronoi/boundary_cells.h"
#include "voronoi/clip.h"
#include "voronoi/diagram.h"
#include "voronoi/solid.h"

namespace bisector::host {

class BoundaryPass {
 public:
  // Both must outlive the object.
  BoundaryPass(const Solid& solid, const TetFrame& enclosure);

  void run(const SortedSeeds& seeds, const Neighbours& neighbours, const RestrictedPolygons& polygons,
           bool want_polyhedra);
  // Once it is known of which slots a cell inside is a neighbour: settles the cells of which polygons do not tell what
  // is inside. False if there are more slots inside then, so that more may be known.
  bool settle(const std::vector<Index>& marks);
  bool is_settled() const { return cells_.open().empty(); }

  // Of the last run: the triangles that each cell meets, by seed; a mark for each slot that has any; the slots off the
  // boundary that share a Voronoi vertex inside with a cell at it, and the boundary cells themselves.
  const Csr<Index>& triangles() const { return triangles_; }
  const std::vector<Index>& marks() const { return marks_; }
  const std::vector<Index>& slots_inside() const { return inside_; }
  std::size_t count() const { return slots_.size(); }
  // Sets the moments of the boundary cells.
  void put_moments(std::vector<Moments>& cells) const;
  // The sum of their masses.
  double mass() const;
  const BoundaryCells& cells() const { return cells_; }

 private:
  struct Worker {
    Clipper clipper;
    std::uint64_t generation = 0;  // of the seeds that the clipper knows
  };

  void group(const RestrictedPolygons& polygons);
  void list_inside();
  void polygons_of(Index slot, std::vector<CellPolygon>& polygons);

  const Surface& surface_;
  BoundaryCells cells_;
  ThreadLocal<Worker> workers_;
  std::uint64_t generation_ = 0;
  const SortedSeeds* seeds_ = nullptr;
  const RestrictedPolygons* polygons_ = nullptr;
  std::vector<Index> labels_;  // of the polygons, with slots
  Csr<std::size_t> of_cell_;   // polygons by seed
  Csr<Index> triangles_;
  BoundaryCells::PolygonsOf polygons_of_;
  std::vector<Index> slots_, marks_, inside_;
  std::vector<Moments> moments_;  // by seed
};

}  // namespace bisector::host
