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
    for (std::size_t k = begin; k < end; ++k)
      if (!evaluate_one(slots[k], BoundaryCell::Side::unknown, mine, chunks_[c])) chunks_[c].open.push_back(slots[k]);
  });
  list_open();
}

void BoundaryCells::list_open() {
  open_.clear();
  for (const Chunk& chunk : chunks_) append_range(open_, chunk.open, 0, chunk.open.size());
  if (open_.empty()) return;
  is_open_.assign(seeds_->x.size(), 0);
  for (const Index slot : open_) is_open_[slot] = 1;
  for (const Index slot : reached())
    if (is_open_[slot]) settle_inside(slot);
  std::erase_if(open_, [&](Index slot) { return !is_open_[slot]; });
}

BoundaryCells::Worker& BoundaryCells::worker() {
  Worker& mine = workers_.local();
  if (mine.generation != generation_) {
    mine.generation = generation_;
    mine.cell.reset(*seeds_, *neighbours_);
  }
  return mine;
}

// False if it is open.
bool BoundaryCells::evaluate_one(Index slot, BoundaryCell::Side vertices, Worker& worker, Chunk& chunk) {
  BoundaryCell& cell = worker.cell;
  (*polygons_of_)(slot, worker.polygons);
  const bool settled = cell.integrate(slot, worker.polygons, vertices);
  chunk.counts.add_doubts(cell);
  if (!settled) return false;
  ++chunk.counts.pairs;
  (*cells_)[seeds_->id[slot]] = cell.moments();
  append_range(chunk.reached, cell.reached(), 0, cell.reached().size());
  if (want_polyhedra_) cell.append_polyhedron(chunk.polyhedra);
  return true;
}

std::vector<Index> BoundaryCells::settle_inside(Index slot) {
  Worker& mine = worker();
  std::vector<Index> found, stack{slot};
  while (!stack.empty()) {
    const Index next = stack.back();
    stack.pop_back();
    if (!is_open_[next]) continue;
    is_open_[next] = 0;
    evaluate_one(next, BoundaryCell::Side::inside, mine, chunks_.back());
    for (const Index other : mine.cell.reached()) {
      found.push_back(other);
      if (is_open_[other]) stack.push_back(other);
    }
  }
  return found;
}

void BoundaryCells::settle_others_outside() {
  for (const Index slot : open_)
    if (is_open_[slot]) {
      is_open_[slot] = 0;
      evaluate_one(slot, BoundaryCell::Side::outside, worker(), chunks_.back());
    }
  open_.clear();
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
