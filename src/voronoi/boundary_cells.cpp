#include "voronoi/boundary_cells.h"

#include "core/append_range.h"
#include "voronoi/polyhedra.h"

namespace bisector {
namespace {

constexpr std::size_t kAtOnce = 16;  // cells of a chunk

}  // namespace

void BoundaryCells::evaluate(const SortedSeeds& seeds, const Neighbours& neighbours, const std::vector<Index>& slots,
                             const PolygonsOf& polygons_of, bool want_polyhedra, std::vector<Moments>& cells) {
  ++generation_;
  seeds_ = &seeds;
  neighbours_ = &neighbours;
  polygons_of_ = &polygons_of;
  want_polyhedra_ = want_polyhedra;
  cells_ = &cells;
  chunks_.clear();
  chunks_.resize((slots.size() + kAtOnce - 1) / kAtOnce + 1);
  parallel_chunks(slots.size(), kAtOnce, [&](std::size_t c, std::size_t begin, std::size_t end) {
    Worker& mine = worker();
    for (std::size_t k = begin; k < end; ++k) evaluate_one(slots[k], BoundaryCell::Side::unknown, mine, chunks_[c]);
  });
}

BoundaryCells::Worker& BoundaryCells::worker() {
  Worker& mine = workers_.local();
  if (mine.generation != generation_) {
    mine.generation = generation_;
    mine.cell.reset(*seeds_, *neighbours_);
  }
  return mine;
}

void BoundaryCells::evaluate_one(Index slot, BoundaryCell::Side vertices, Worker& worker, Chunk& chunk) {
  BoundaryCell& cell = worker.cell;
  (*polygons_of_)(slot, worker.polygons);
  const bool settled = cell.integrate(slot, worker.polygons, vertices);
  chunk.counts.add_doubts(cell);
  if (!settled) {
    chunk.open.push_back(slot);
    return;
  }
  ++chunk.counts.pairs;
  (*cells_)[seeds_->id[slot]] = cell.moments();
  append_range(chunk.reached, cell.reached(), 0, cell.reached().size());
  if (want_polyhedra_) cell.append_polyhedron(chunk.polyhedra);
}

std::vector<Index> BoundaryCells::open() const {
  std::vector<Index> slots;
  for (const Chunk& chunk : chunks_) append_range(slots, chunk.open, 0, chunk.open.size());
  return slots;
}

const std::vector<Index>& BoundaryCells::settle(Index slot, BoundaryCell::Side vertices) {
  Worker& mine = worker();
  evaluate_one(slot, vertices, mine, chunks_.back());
  return mine.cell.reached();
}

std::vector<Index> BoundaryCells::reached() const {
  std::vector<Index> slots;
  for (const Chunk& chunk : chunks_) append_range(slots, chunk.reached, 0, chunk.reached.size());
  return slots;
}

PairCounts BoundaryCells::counts() const {
  PairCounts counts;
  for (const Chunk& chunk : chunks_) counts += chunk.counts;
  return counts;
}

}  // namespace bisector
