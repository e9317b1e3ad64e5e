#include "voronoi/clipped.h"

#include <algorithm>

#include "core/marks.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "voronoi/boundary_cells.h"
#include "voronoi/clip_tet.h"
#include "voronoi/fixed_tree_sum.h"
#include "voronoi/polyhedra.h"
#include "voronoi/step_mass.h"
#include "voronoi/totals.h"

namespace bisector {
namespace {

constexpr std::size_t kWalks = 16;    // cells of a chunk that are cut up
constexpr std::size_t kWholes = 256;  // cells of a chunk that are taken whole

// What one chunk of cells contributes.
struct Chunk {
  std::vector<Index> first_neighbour;  // of each cell, in `neighbours`; and one past the last
  std::vector<Index> neighbours;       // slots of the bisectors of its polyhedra
  std::vector<Index> tets;             // of each neighbour: one where the two cells meet; not for cells taken whole
  ClippedPolyhedra polyhedra;
  PairCounts counts;

  void clear() {
    first_neighbour.clear();
    neighbours.clear();
    tets.clear();
    polyhedra = {};
    counts = {};
  }
};

// Per thread: a clipper, and what the current cell has met.
struct Walker {
  TetClipper clipper;
  Marks tets, cells;
  struct Term {
    Index tet;
    Moments moments;
  };
  std::vector<Index> queue;
  std::vector<Term> terms;
  FixedTreeSum sum;
  std::uint64_t generation = 0;  // of the seeds that the clipper knows
};

}  // namespace

struct ClippedVoronoi::Work {
  const Solid& solid;
  const bool whole;
  RestrictedVoronoi boundary;
  std::vector<TetFrame> frames;  // of the tetrahedra
  TetFrame enclosure;
  ThreadLocal<Walker> walkers;
  BoundaryCells boundary_cells;  // for cells as wholes
  std::uint64_t generation = 0;
  std::vector<std::vector<Chunk>> rounds;
  std::size_t round_count = 0;
  std::vector<char> known;  // of each slot: it has been reached

  struct Start {
    Index slot, tet;
  };

  Work(const Solid& s, SolidCells how);

  const SortedSeeds& seeds() const { return boundary.seeds(); }
  Walker& walker();
  std::vector<Chunk>& next_round(std::size_t chunks);
  template <class Starts>
  void walk(Index slot, const Starts& starts, Walker& walker, Chunk& chunk, bool want_polyhedra) const;
  void sum_terms(Index slot, Walker& walker, CellMoments& result) const;
  void take_whole(Index slot, Walker& walker, Chunk& chunk, CellMoments& result, bool want_polyhedra) const;
  std::vector<Index> mark_boundary(const CellMoments& result);
  std::vector<Start> walk_boundary(const std::vector<Index>& slots, CellMoments& result, bool want_polyhedra);
  void walk_inner(std::vector<Start> frontier, CellMoments& result, bool want_polyhedra);
  const std::vector<Chunk>& take_all_inner(const std::vector<Index>& slots, CellMoments& result, bool want_polyhedra);
  void take_cells_whole(const std::vector<Index>& on_boundary, CellMoments& result, bool want_polyhedra);
  std::vector<Start> newly_reached(const std::vector<Chunk>& chunks);
  void gather(ClippedPolyhedra& polyhedra) const;
  DiagramWork evaluate(const std::vector<Vec3>& given, NeighbourSource source, Want want, Diagram& diagram);
};

ClippedVoronoi::Work::Work(const Solid& s, SolidCells how)
    : solid(s), whole(how == SolidCells::whole && s.density.empty()), boundary(s.boundary, kListsInSpace),
      frames(whole ? std::vector<TetFrame>{} : tet_frames(s)), enclosure(enclosure_frame(s)),
      boundary_cells(s.boundary, enclosure) {}

Walker& ClippedVoronoi::Work::walker() {
  Walker& walker = walkers.local();
  if (walker.generation != generation) {
    walker.generation = generation;
    walker.clipper.reset(seeds(), boundary.neighbours());
  }
  return walker;
}

std::vector<Chunk>& ClippedVoronoi::Work::next_round(std::size_t chunks) {
  if (rounds.size() == round_count) rounds.emplace_back();
  std::vector<Chunk>& round = rounds[round_count++];
  round.resize(chunks);
  for (Chunk& chunk : round) chunk.clear();
  return round;
}

// Cuts up the part of the cell that hangs together with the tetrahedra of `starts`, which it is known to meet.
template <class Starts>
void ClippedVoronoi::Work::walk(Index slot, const Starts& starts, Walker& walker, Chunk& chunk,
                                bool want_polyhedra) const {
  TetClipper& clipper = walker.clipper;
  const bool uniform = solid.density.empty();
  clipper.begin(slot);
  walker.tets.begin(frames.size());
  walker.cells.begin(seeds().x.size());
  walker.queue.clear();
  walker.terms.clear();
  chunk.first_neighbour.push_back(static_cast<Index>(chunk.neighbours.size()));
  clipper.narrow(enclosure);
  for (const Index tet : starts)
    if (walker.tets.mark(tet)) walker.queue.push_back(tet);
  for (std::size_t head = 0; head < walker.queue.size(); ++head) {
    const Index tet = walker.queue[head];
    const bool found = clipper.clip(frames[tet]);
    chunk.counts.add_doubts(clipper);
    if (!found) continue;
    ++chunk.counts.pairs;
    clipper.each_label([&](Index label) {
      if (is_facet(label)) {
        const Index across = solid.adjacent[tet][label & ~kFacetLabel];
        if (across == kNone || !walker.tets.mark(across)) return;
        walker.queue.push_back(across);
        for (std::size_t line = 0; line < sizeof(TetFrame); line += 64)
          __builtin_prefetch(reinterpret_cast<const char*>(&frames[across]) + line);
      } else if (walker.cells.mark(label)) {
        chunk.neighbours.push_back(label);
        chunk.tets.push_back(tet);
      }
    });
    walker.terms.push_back({tet, uniform ? clipper.integrate<true>() : clipper.integrate<false>()});
    if (want_polyhedra) append_polyhedron(clipper, seeds(), tet, slot, chunk.polyhedra);
  }
}

// Adds up what the last walk has found in the tetrahedra.
void ClippedVoronoi::Work::sum_terms(Index slot, Walker& walker, CellMoments& result) const {
  std::sort(walker.terms.begin(), walker.terms.end(), [](const auto& a, const auto& b) { return a.tet < b.tet; });
  for (const Walker::Term& term : walker.terms) walker.sum.add(term.moments);
  result.cells[seeds().id[slot]] = walker.sum.finish();
}

void ClippedVoronoi::Work::take_whole(Index slot, Walker& walker, Chunk& chunk, CellMoments& result,
                                      bool want_polyhedra) const {
  TetClipper& clipper = walker.clipper;
  clipper.begin(slot);
  chunk.first_neighbour.push_back(static_cast<Index>(chunk.neighbours.size()));
  const bool found = clipper.clip(enclosure);
  chunk.counts.add_doubts(clipper);
  if (!found) return;
  const std::size_t first = chunk.neighbours.size();
  bool bounded = true;
  clipper.each_label([&](Index label) {
    bounded = bounded && !is_facet(label);
    chunk.neighbours.push_back(label);
  });
  // A cell that reaches out of the enclosure lies outside the solid or on its boundary.
  if (!bounded) return chunk.neighbours.resize(first);
  result.cells[seeds().id[slot]] = clipper.integrate<true>();
  if (want_polyhedra) append_polyhedron(clipper, seeds(), kNone, slot, chunk.polyhedra);
}

// The cells across the bisectors of `chunks` that were not known, in order of slots; they are now.
std::vector<ClippedVoronoi::Work::Start> ClippedVoronoi::Work::newly_reached(const std::vector<Chunk>& chunks) {
  std::vector<Start> reached;
  for (const Chunk& chunk : chunks)
    for (std::size_t k = 0; k < chunk.neighbours.size(); ++k)
      if (!known[chunk.neighbours[k]]) {
        known[chunk.neighbours[k]] = true;
        reached.push_back({chunk.neighbours[k], chunk.tets[k]});
      }
  std::sort(reached.begin(), reached.end(), [](const Start& a, const Start& b) { return a.slot < b.slot; });
  return reached;
}

// The cells that meet the boundary, which are known from the start.
std::vector<Index> ClippedVoronoi::Work::mark_boundary(const CellMoments& result) {
  std::vector<Index> slots;
  known.assign(seeds().x.size(), false);
  for (Index s = 0; s < known.size(); ++s)
    if (result.triangles.size(seeds().id[s])) {
      slots.push_back(s);
      known[s] = true;
    }
  return slots;
}

// Cuts up these cells from the tetrahedra under the triangles that they meet. A part of such a cell that the boundary
// does not bound would be all of the cell, so this finds every part.
std::vector<ClippedVoronoi::Work::Start> ClippedVoronoi::Work::walk_boundary(const std::vector<Index>& slots,
                                                                             CellMoments& result, bool want_polyhedra) {
  std::vector<Chunk>& chunks = next_round((slots.size() + kWalks - 1) / kWalks);
  parallel_chunks(slots.size(), kWalks, [&](std::size_t c, std::size_t begin, std::size_t end) {
    Walker& local = walker();
    std::vector<Index> starts;
    for (std::size_t k = begin; k < end; ++k) {
      const Index i = seeds().id[slots[k]];
      starts.clear();
      for (const Index* t = result.triangles.begin(i); t != result.triangles.end(i); ++t)
        starts.push_back(solid.tet_of_triangle[*t]);
      walk(slots[k], starts, local, chunks[c], want_polyhedra);
      sum_terms(slots[k], local, result);
    }
  });
  return newly_reached(chunks);
}

// A cell that does not meet the boundary but shares a bisector with one inside the solid lies inside itself.
void ClippedVoronoi::Work::walk_inner(std::vector<Start> frontier, CellMoments& result, bool want_polyhedra) {
  while (!frontier.empty()) {
    std::vector<Chunk>& chunks = next_round((frontier.size() + kWalks - 1) / kWalks);
    parallel_chunks(frontier.size(), kWalks, [&](std::size_t c, std::size_t begin, std::size_t end) {
      Walker& local = walker();
      for (std::size_t k = begin; k < end; ++k) {
        walk(frontier[k].slot, std::array<Index, 1>{frontier[k].tet}, local, chunks[c], want_polyhedra);
        sum_terms(frontier[k].slot, local, result);
      }
    });
    frontier = newly_reached(chunks);
  }
}

const std::vector<Chunk>& ClippedVoronoi::Work::take_all_inner(const std::vector<Index>& slots, CellMoments& result,
                                                               bool want_polyhedra) {
  std::vector<Chunk>& chunks = next_round((slots.size() + kWholes - 1) / kWholes);
  parallel_chunks(slots.size(), kWholes, [&](std::size_t c, std::size_t begin, std::size_t end) {
    Walker& local = walker();
    for (std::size_t k = begin; k < end; ++k) take_whole(slots[k], local, chunks[c], result, want_polyhedra);
    chunks[c].first_neighbour.push_back(static_cast<Index>(chunks[c].neighbours.size()));
  });
  return chunks;
}

// Boundary cells by their polygons. All others are taken whole at first, and then those kept that share a Voronoi
// vertex inside with a cell that has one.
void ClippedVoronoi::Work::take_cells_whole(const std::vector<Index>& on_boundary, CellMoments& result,
                                            bool want_polyhedra) {
  std::vector<Index> slots, place(known.size(), kNone), queue;
  for (Index s = 0; s < known.size(); ++s)
    if (!known[s]) {
      place[s] = static_cast<Index>(slots.size());
      slots.push_back(s);
    }
  const BoundaryCells::PolygonsOf polygons_of = [&](Index slot, std::vector<CellPolygon>& polygons) {
    boundary.polygons_of(slot, polygons);
  };
  boundary_cells.evaluate(seeds(), boundary.neighbours(), on_boundary, polygons_of, want_polyhedra, result.cells);
  const std::vector<Chunk>& chunks = take_all_inner(slots, result, want_polyhedra);

  for (const Index slot : boundary_cells.open()) known[slot] = false;
  const auto reach = [&](Index slot) {
    if (known[slot]) return;
    known[slot] = true;
    queue.push_back(slot);
  };
  for (const Index slot : boundary_cells.reached()) reach(slot);
  for (std::size_t head = 0; head < queue.size(); ++head) {
    const Index slot = queue[head];
    if (place[slot] == kNone) {  // an open one, or one that others have settled
      if (boundary_cells.is_open(slot))
        for (const Index next : boundary_cells.settle_inside(slot)) reach(next);
      continue;
    }
    const Chunk& chunk = chunks[place[slot] / kWholes];
    const std::size_t k = place[slot] % kWholes;
    for (Index n = chunk.first_neighbour[k]; n < chunk.first_neighbour[k + 1]; ++n) reach(chunk.neighbours[n]);
  }
  for (const Index slot : on_boundary) known[slot] = true;
  boundary_cells.settle_others_outside();
  for (const Index slot : slots)
    if (!known[slot]) result.cells[seeds().id[slot]] = {};
}

DiagramWork ClippedVoronoi::Work::evaluate(const std::vector<Vec3>& given, NeighbourSource source, Want want,
                                           Diagram& diagram) {
  DiagramWork work = boundary.trace(given, source, want, diagram);
  CellMoments& result = diagram.moments;
  Stopwatch watch;
  ++generation;
  round_count = 0;
  result.cells.assign(given.size(), Moments{});
  const bool want_polyhedra = includes(want, Want::polyhedra);
  const std::vector<Index> on_boundary = mark_boundary(result);
  if (whole) take_cells_whole(on_boundary, result, want_polyhedra);
  else walk_inner(walk_boundary(on_boundary, result, want_polyhedra), result, want_polyhedra);
  set_step_masses(seeds(), boundary.neighbours(), result);
  set_totals(result);
  work.counts = {};
  for (std::size_t r = 0; r < round_count; ++r)
    for (const Chunk& chunk : rounds[r]) work.counts += chunk.counts;
  if (whole) {
    work.counts += boundary_cells.counts();
    work.counts.pairs = static_cast<std::size_t>(std::count(known.begin(), known.end(), true));
  }
  work.owners += work.clip;
  work.clip = watch.seconds();
  if (want_polyhedra) gather(diagram.polyhedra);
  return work;
}

void ClippedVoronoi::Work::gather(ClippedPolyhedra& polyhedra) const {
  std::vector<const ClippedPolyhedra*> parts;
  for (std::size_t r = 0; r < round_count; ++r)
    for (const Chunk& chunk : rounds[r]) parts.push_back(&chunk.polyhedra);
  if (whole) boundary_cells.each_part([&](const ClippedPolyhedra& part) { parts.push_back(&part); });
  gather_polyhedra(
      parts, [&](const auto& pair) { return known[seeds().slot[pair.cell]] != 0; }, polyhedra);
}

ClippedVoronoi::ClippedVoronoi(const Solid& solid, SolidCells how) : work_(std::make_unique<Work>(solid, how)) {}
ClippedVoronoi::~ClippedVoronoi() = default;

DiagramWork ClippedVoronoi::evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, Want want,
                                     Diagram& diagram) {
  return work_->evaluate(seeds, source, want, diagram);
}

std::vector<Tetrahedron> dual_tets(const ClippedPolyhedra& polyhedra) {
  std::vector<Tetrahedron> tets;
  for (std::size_t k = 0; k < polyhedra.pairs.size(); ++k) {
    const Index cell = polyhedra.pairs[k].cell;
    const Index* labels = polyhedra.labels.data() + polyhedra.label_offsets[k];
    for (std::size_t v = polyhedra.vertex_offsets[k]; v < polyhedra.vertex_offsets[k + 1]; ++v) {
      const auto& on = polyhedra.triples[v];
      Tetrahedron tet{cell, labels[on[0]], labels[on[1]], labels[on[2]]};
      // Facets compare as greater than seeds. Each vertex is seen from its four cells; the lowest reports it.
      if (is_facet(std::max({tet[1], tet[2], tet[3]})) || std::min({tet[1], tet[2], tet[3]}) < cell) continue;
      std::sort(tet.begin(), tet.end());
      tets.push_back(tet);
    }
  }
  sort_in_parallel(tets, [](const Tetrahedron& a, const Tetrahedron& b) { return a < b; });
  tets.erase(std::unique(tets.begin(), tets.end()), tets.end());
  return tets;
}

}  // namespace bisector
