#include "cvt/optimise_around.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "backend/cpu_backend.h"

namespace bisector {
namespace {

// Rings of seeds around those that changed that move with them; beyond, the change is hardly felt.
constexpr int kRings = 2;
// Of the triangles; a larger piece costs as much as the whole surface.
constexpr double kLargePiece = 0.75;

// Positions in lexicographic order, to look others up.
class PositionIndex {
 public:
  explicit PositionIndex(const std::vector<Vec3>& positions) : positions_(positions), order_(positions.size()) {
    std::iota(order_.begin(), order_.end(), Index{0});
    std::sort(order_.begin(), order_.end(), [&](Index a, Index b) { return key(positions_[a]) < key(positions_[b]); });
  }
  // A seed at this very position, or kNone.
  Index find(const Vec3& p) const {
    const auto at = std::lower_bound(order_.begin(), order_.end(), p,
                                     [&](Index i, const Vec3& q) { return key(positions_[i]) < key(q); });
    return at != order_.end() && positions_[*at] == p ? *at : kNone;
  }

 private:
  static std::tuple<double, double, double> key(const Vec3& p) { return {p.x, p.y, p.z}; }

  const std::vector<Vec3>& positions_;
  std::vector<Index> order_;
};

// Marks seeds that are new or were neighbours of one that is gone.
std::vector<char> changed_seeds(const SeedsBefore& before, const std::vector<Vec3>& now) {
  const PositionIndex old_seeds(before.positions), new_seeds(now);
  std::vector<char> changed(now.size(), 0);
  for (std::size_t i = 0; i < now.size(); ++i) changed[i] = old_seeds.find(now[i]) == kNone;
  std::vector<Index> is_now(before.positions.size());
  for (std::size_t i = 0; i < is_now.size(); ++i) is_now[i] = new_seeds.find(before.positions[i]);
  for (const DualEdge& edge : before.edges) {
    const Index a = is_now[edge.a], b = is_now[edge.b];
    if (a == kNone && b != kNone) changed[b] = 1;
    if (b == kNone && a != kNone) changed[a] = 1;
  }
  return changed;
}

// The marked triangles as a domain of their own, and the seeds with cells on them.
struct Piece {
  Surface surface;
  std::vector<Index> seeds;  // of the run, ascending
};

Surface marked_surface(const Surface& whole, const std::vector<char>& marked) {
  std::vector<Index> triangles;
  for (Index t = 0; t < marked.size(); ++t)
    if (marked[t]) triangles.push_back(t);
  SurfacePart part = part_of(whole, std::move(triangles));
  return Surface(std::move(part.mesh), std::move(part.density));
}

std::vector<Index> seeds_on(const RestrictedPolygons& polygons, const std::vector<char>& triangles, std::size_t count) {
  std::vector<char> present(count, 0);
  for (const auto& [triangle, cell] : polygons.pairs)
    if (triangles[triangle]) present[cell] = 1;
  std::vector<Index> seeds;
  for (Index i = 0; i < count; ++i)
    if (present[i]) seeds.push_back(i);
  return seeds;
}

void move_on_piece(CvtRun& run, const Piece& piece, const std::vector<char>& free, const MoveSeeds& move) {
  CpuBackend backend(piece.surface, NeighbourSource::nearest);
  CvtRun part(backend, run.curves(), run.context());
  for (const Index i : piece.seeds) {
    SeedPlace place = run.seeds.place(i);
    if (!free[i]) place.kind = SeedPlace::Kind::fixed;
    part.seeds.add(run.seeds.position(i), place);
  }
  part.localise(run.localises());
  move(part, piece.seeds);
  for (std::size_t k = 0; k < piece.seeds.size(); ++k)
    if (free[piece.seeds[k]]) run.seeds.put(piece.seeds[k], part.seeds.position(k), part.seeds.place(k));
  run.totals += part.totals;
}

// Seeds that move, and those whose cells that changes.
struct Moving {
  std::vector<char> seeds, cells;

  bool any() const { return !seeds.empty(); }
};

// None if no seeds have changed.
Moving around_changes(CvtRun& run, const SeedsBefore& before) {
  Moving moving{changed_seeds(before, run.seeds.positions()), {}};
  if (std::find(moving.seeds.begin(), moving.seeds.end(), 1) == moving.seeds.end()) return {};
  const std::vector<DualEdge> edges = extract_dual_edges(run.diagram(Want::polygons).polygons, run.seeds.positions());
  for (int ring = 0; ring < kRings; ++ring) mark_neighbours(edges, moving.seeds);
  moving.cells = moving.seeds;
  mark_neighbours(edges, moving.cells);
  return moving;
}

void move_marked(CvtRun& run, const Moving& moving, const MoveSeeds& move) {
  const Diagram& diagram = run.diagram(Want::polygons);
  const Csr<Index>& cells = diagram.moments.triangles;
  std::vector<char> triangles(run.surface().mesh.triangles.size(), 0);
  std::size_t count = 0;
  for (std::size_t i = 0; i < moving.cells.size(); ++i)
    for (const Index* t = cells.begin(i); moving.cells[i] && t != cells.end(i); ++t)
      count += !std::exchange(triangles[*t], 1);
  if (count == 0 || static_cast<double>(count) > kLargePiece * static_cast<double>(triangles.size())) {
    std::vector<Index> all(run.seeds.size());
    std::iota(all.begin(), all.end(), Index{0});
    return move(run, all);
  }
  const std::vector<Index> seeds = seeds_on(diagram.polygons, triangles, run.seeds.size());
  move_on_piece(run, {marked_surface(run.surface(), triangles), seeds}, moving.seeds, move);
}

}  // namespace

SeedsBefore seeds_before(CvtRun& run) {
  return {run.seeds.positions(), extract_dual_edges(run.diagram(Want::polygons).polygons, run.seeds.positions())};
}

void move_around(CvtRun& run, const SeedsBefore& before, const MoveSeeds& move) {
  if (const Moving moving = around_changes(run, before); moving.any()) move_marked(run, moving, move);
}

void optimise_around(CvtRun& run, const SeedsBefore& before, const OptimiseOptions& options, Backend* stand_in) {
  const auto optimise_marked = [&](const Moving& moving, int iterations) {
    OptimiseOptions some = options;
    some.iterations = iterations;
    move_marked(run, moving, [&](CvtRun& part, const std::vector<Index>&) { optimise(part, some); });
  };
  Backend& own = run.backend();
  if (stand_in) run.change_backend(*stand_in);
  const Moving moving = around_changes(run, before);
  const int on_surface = stand_in ? static_cast<int>(kOnSurfaceShare * options.iterations) : 0;
  if (moving.any()) optimise_marked(moving, options.iterations - on_surface);
  if (!stand_in) return;
  run.change_backend(own);
  // Without any step, seeds that are to be on the surface are put there all the same.
  if (moving.any() && (on_surface > 0 || options.constrained)) optimise_marked(moving, on_surface);
}

}  // namespace bisector
