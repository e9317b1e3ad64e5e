#include "tetmesh/inner_phase.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "backend/project.h"
#include "tetmesh/tet_levels.h"

namespace bisector {
namespace {

using Kind = SeedPlace::Kind;

constexpr double kInnerShare = 0.15;  // of the steps that the whole run is allowed
constexpr int kPushRounds = 8;        // after which sites that still own a part of the boundary are removed
// How far above the boundary, in boundary edge lengths, a site may sit without owning a piece of it. Layers of a dense
// packing are 0.8 apart.
constexpr double kClearance = 0.75;
constexpr double kLeastPush = 0.1;  // edge lengths

// Removes so many of the most crowded sites inside, whose cells have the least energy.
void remove_crowded(CvtRun& sites, std::size_t boundary, std::size_t count) {
  const std::vector<Moments>& cells = sites.diagram().moments.cells;
  std::vector<Index> order;
  for (auto i = static_cast<Index>(boundary); i < sites.seeds.size(); ++i) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return cells[a].second < cells[b].second; });
  order.resize(std::min(count, order.size()));
  std::sort(order.begin(), order.end());
  sites.seeds.remove(order);
}

// Adds so many sites where cells are large, or fewer.
void add_sites(CvtRun& sites, std::size_t count) {
  const Diagram& diagram = sites.diagram(Want::polygons | Want::polyhedra);
  sites.seeds.add(far_corners(diagram, sites.seeds.positions(), count), {Kind::interior});
}

void match_count(TetRun& run, std::size_t boundary) {
  const std::size_t count = run.sites.seeds.size();
  if (count > run.wanted) remove_crowded(run.sites, boundary, count - run.wanted);
  if (count < run.wanted) add_sites(run.sites, run.wanted - count);
}

// Moves sites that own a part of the boundary away from it, along its normal.
void push(const Surface& boundary, const Csr<Index>& triangles, const std::vector<Index>& sites,
          const std::vector<Moments>& cells, double usual_edge, PlacedSeeds& seeds) {
  std::vector<Vec3> feet = seeds.positions(), normals;
  project_to_cells(boundary, triangles, {}, feet, normals);
  const std::span<Vec3> positions = seeds.edit_positions();
  for (const Index i : sites) {
    const Moments& cell = cells[i];
    // The cell's radius stands for the edge length there.
    const double edge = cell.mass > 0 ? 2 * std::sqrt(cell.second / cell.mass) : usual_edge;
    const double height = dot(feet[i] - positions[i], normals[i]);
    positions[i] -= std::max(kLeastPush * edge, kClearance * edge - height) * normals[i];
  }
}

// The dual contains the boundary only if no cell of a site inside meets it: such sites are pushed away from it, and
// those that nothing helps are removed. `triangles` tells which ones each cell of the seeds meets, and `cells` how
// large the cells were before.
template <class Triangles>
void clear_boundary(TetRun& run, const Surface& boundary, const std::vector<Moments>& cells,
                    const Triangles& triangles) {
  PlacedSeeds& seeds = run.sites.seeds;
  for (int round = 0;; ++round) {
    const Csr<Index>& met = triangles();
    const std::vector<Index> at_boundary = inner_sites_at_boundary(seeds, met);
    if (at_boundary.empty()) return;
    if (round == kPushRounds) {
      seeds.remove(at_boundary);
      return;
    }
    push(boundary, met, at_boundary, cells, run.sized.edge_length, seeds);
  }
}

// The positions of the sites inside.
std::vector<Vec3> inside_of(const PlacedSeeds& seeds) {
  std::vector<Vec3> inside;
  for (std::size_t i = 0; i < seeds.size(); ++i)
    if (seeds.kind(i) == Kind::interior) inside.push_back(seeds.position(i));
  return inside;
}

}  // namespace

void inner_phase(TetRun& run, const RemeshResult& surface, SolidBackend* stand_in) {
  const std::size_t boundary = surface.mesh.vertices.size();
  run.sites.seeds = with_boundary(surface, inside_of(run.sites.seeds));
  for (SeedPlace& place : run.sites.seeds.edit_places().first(boundary)) place.kind = Kind::fixed;
  if (stand_in) run.sites.change_backend(*stand_in);
  match_count(run, boundary);
  optimise_sites(run, "inside", kInnerShare, false);
  const std::vector<Moments> cells = run.sites.diagram().moments.cells;
  // Most of what has to be pushed away is found there, and only the rest at the boundary itself.
  if (stand_in)
    clear_boundary(run, run.sites.surface(), cells,
                   [&]() -> const Csr<Index>& { return run.sites.diagram(Want::triangles).moments.triangles; });
  run.sites.change_backend(run.solid);
  Diagram on_boundary;
  clear_boundary(run, run.boundary.surface(), cells, [&]() -> const Csr<Index>& {
    run.boundary.evaluate(run.sites.seeds.positions(), Want::triangles, on_boundary);
    return on_boundary.moments.triangles;
  });
  complete(run.sites, false);
}

}  // namespace bisector
