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
      : workers_([&surface, &enclosure] {
          return Worker{BoundaryCell(surface, enclosure), {}, 0};
        }) {}

  // Sets the moments of the cells of these slots, which meet the surface, and their polyhedra if they are wanted. All
  // arguments must outlive the calls of the functions that settle.
  void evaluate(const SortedSeeds& seeds, const Neighbours& neighbours, const std::vector<Index>& slots,
                const PolygonsOf& polygons_of, bool want_polyhedra, std::vector<Moments>& cells);
  // Cells are open as long as neither their polygons nor other cells at the boundary tell on which side of it their
  // Voronoi vertices lie. They lie inside if a cell that has vertices inside is a neighbour, and outside if none is.
  const std::vector<Index>& open() const { return open_; }
  bool is_open(Index slot) const { return !open_.empty() && is_open_[slot]; }
  // Evaluates one that is open and lies inside, and those that follow from it. Returns the slots that share a Voronoi
  // vertex inside with one of these.
  std::vector<Index> settle_inside(Index slot);
  void settle_others_outside();

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
    std::vector<Index> open, reached;  // open at first
    ClippedPolyhedra polyhedra;
    PairCounts counts;
  };
  struct Worker {
    BoundaryCell cell;
    std::vector<CellPolygon> polygons;
    std::uint64_t generation;  // of the seeds that the cell knows
  };

  Worker& worker();
  void list_open();
  bool evaluate_one(Index slot, BoundaryCell::Side vertices, Worker& worker, Chunk& chunk);

  ThreadLocal<Worker> workers_;
  std::uint64_t generation_ = 0;
  const SortedSeeds* seeds_ = nullptr;
  const Neighbours* neighbours_ = nullptr;
  const PolygonsOf* polygons_of_ = nullptr;
  bool want_polyhedra_ = false;
  std::vector<Moments>* cells_ = nullptr;
  std::vector<Chunk> chunks_;  // the last one is that of cells settled afterwards
  std::vector<Index> open_;
  std::vector<char> is_open_;  // of each slot; only if any is
};

}  // namespace bisector
