// All boundary cells of a solid of uniform density.
#pragma once

#include <functional>
#include <vector>

#include "core/parallel.h"
#include "voronoi/boundary_cell.h"
#include "voronoi/diagram.h"

namespace bisector {

class BoundaryCells {
 public:
  // Sets the polygons in which a slot's cell meets the surface, in ascending order of triangles. For many threads.
  using PolygonsOf = std::function<void(Index slot, std::vector<CellPolygon>& polygons)>;

  // The solid's boundary and its enclosure must outlive the object.
  BoundaryCells(const Surface& surface, const TetFrame& enclosure)
      : workers_([&surface, &enclosure] { return Worker{BoundaryCell(surface, enclosure), {}, 0}; }) {}

  // Sets the moments of the cells of these slots, which meet the surface, and their polyhedra if they are wanted. All
  // arguments must outlive the calls of settle().
  void evaluate(const SortedSeeds& seeds, const Neighbours& neighbours, const std::vector<Index>& slots,
                const PolygonsOf& polygons_of, bool want_polyhedra, std::vector<Moments>& cells);
  // Cells whose polygons do not tell on which side their Voronoi vertices lie. They are inside if a cell that has
  // vertices inside reaches one of them, and outside if none does.
  std::vector<Index> open() const;
  // Evaluates one of these. Returns the slots that share a Voronoi vertex inside with it, until the next call.
  const std::vector<Index>& settle(Index slot, BoundaryCell::Side vertices);

  // The slots that share a Voronoi vertex inside with one of the cells; some more than once.
  std::vector<Index> reached() const;
  PairCounts counts() const;
  // Visits the polyhedra, in parts.
  template <class Visit>
  void each_part(const Visit& visit) const {
    for (const Chunk& chunk : chunks_) visit(chunk.polyhedra);
  }

 private:
  // What some of the cells contribute.
  struct Chunk {
    std::vector<Index> open, reached;
    ClippedPolyhedra polyhedra;
    PairCounts counts;
  };
  struct Worker {
    BoundaryCell cell;
    std::vector<CellPolygon> polygons;
    std::uint64_t generation;  // of the seeds that the cell knows
  };

  Worker& worker();
  void evaluate_one(Index slot, BoundaryCell::Side vertices, Worker& worker, Chunk& chunk);

  ThreadLocal<Worker> workers_;
  std::uint64_t generation_ = 0;
  const SortedSeeds* seeds_ = nullptr;
  const Neighbours* neighbours_ = nullptr;
  const PolygonsOf* polygons_of_ = nullptr;
  bool want_polyhedra_ = false;
  std::vector<Moments>* cells_ = nullptr;
  std::vector<Chunk> chunks_;  // the last one is that of cells settled afterwards
};

}  // namespace bisector
