#include "tetmesh/inner_phase.h"

#include <algorithm>
#include <cmath>

#include "cvt/constrain.h"
#include "tetmesh/tet_levels.h"

namespace bisector {
namespace {

using Kind = SeedPlace::Kind;

constexpr double kInnerShare = 0.15;  // of the steps that the whole run is allowed
constexpr int kPushRounds = 8;        // after which sites that still own a part of the boundary are removed
// How far above the boundary, in boundary edge lengths, a site may sit without owning a piece of it. Layers of a dense
// packing are 0.8 apart.
constexpr double kClearance = 0.75;
constexpr double kLeastPush = 0.1;    // edge lengths

void remove(const std::vector<char>& removed, CvtState& state) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < state.seeds.size(); ++i) {
    if (removed[i]) continue;
    state.seeds[n] = state.seeds[i];
    state.places[n++] = state.places[i];
  }
  state.seeds.resize(n);
  state.places.resize(n);
}

// Removes so many of the most crowded sites inside, whose cells have the least energy.
void remove_crowded(SolidBackend& solid, std::size_t boundary, std::size_t count, CvtState& state) {
  solid.evaluate(state.seeds, state.moments);
  std::vector<Index> order;
  for (auto i = static_cast<Index>(boundary); i < state.seeds.size(); ++i) order.push_back(i);
  count = std::min(count, order.size());
  std::stable_sort(order.begin(), order.end(),
                   [&](Index a, Index b) { return state.moments.cells[a].second < state.moments.cells[b].second; });
  std::vector<char> removed(state.seeds.size(), 0);
  for (std::size_t k = 0; k < count; ++k) removed[order[k]] = 1;
  remove(removed, state);
}

// Adds so many sites where cells are large, or fewer.
void add_sites(SolidBackend& solid, std::size_t count, CvtState& state) {
  RestrictedPolygons polygons;
  ClippedPolyhedra polyhedra;
  solid.evaluate(state.seeds, state.moments, polygons, polyhedra);
  for (const Vec3& p : far_corners(polyhedra, state.moments, state.seeds, count)) {
    state.seeds.push_back(p);
    state.places.push_back({Kind::interior});
  }
}

void match_count(TetRun& run, std::size_t boundary, CvtState& state) {
  const std::size_t count = state.seeds.size();
  if (count > run.wanted) remove_crowded(run.solid, boundary, count - run.wanted, state);
  if (count < run.wanted) add_sites(run.solid, run.wanted - count, state);
}

// Moves sites that own a part of the boundary away from it, along its normal.
void push(const TetRun& run, const std::vector<Index>& sites, CvtState& state) {
  std::vector<Vec3> feet = state.seeds, normals;
  project_to_cells(run.solid.surface(), state.moments.triangles, {}, feet, normals);
  for (const Index i : sites) {
    const Moments& cell = state.moments.cells[i];
    // The cell's radius stands for the edge length there.
    const double edge = cell.mass > 0 ? 2 * std::sqrt(cell.second / cell.mass) : run.sized.edge_length;
    const double height = dot(feet[i] - state.seeds[i], normals[i]);
    state.seeds[i] -= std::max(kLeastPush * edge, kClearance * edge - height) * normals[i];
  }
}

// The dual contains the boundary only if no cell of a site inside meets it: such sites are pushed away from it, and
// those that nothing helps are removed.
void clear_boundary(const TetRun& run, CvtState& state) {
  for (int round = 0;; ++round) {
    run.solid.evaluate(state.seeds, state.moments);
    const std::vector<Index> at_boundary = inner_sites_at_boundary(state);
    if (at_boundary.empty()) return;
    if (round == kPushRounds) {
      std::vector<char> removed(state.seeds.size(), 0);
      for (const Index i : at_boundary) removed[i] = 1;
      remove(removed, state);
      return;
    }
    push(run, at_boundary, state);
  }
}

}  // namespace

CvtState inner_phase(TetRun& run, const RemeshResult& surface, const std::vector<Vec3>& inside) {
  const std::size_t boundary = surface.mesh.vertices.size();
  CvtState state = with_boundary(surface, inside);
  for (std::size_t i = 0; i < boundary; ++i) state.places[i].kind = Kind::fixed;
  match_count(run, boundary, state);
  optimise_sites(run, run.solid, state, "inside", kInnerShare, false);
  clear_boundary(run, state);
  OptimiseOptions step;
  step.curves = &run.curves;
  complete(run.solid, state, step, run.totals);
  return state;
}

}  // namespace bisector
