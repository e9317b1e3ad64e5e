#include "tetmesh/free_phase.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "tetmesh/sample_solid.h"
#include "tetmesh/tet_levels.h"

namespace bisector {
namespace {

// Shares of the steps that the whole run is allowed.
constexpr double kLevelShare = 0.35;   // on the only level, and on each of the coarser ones
constexpr double kFinestShare = 0.2;   // on the finest of several levels, which starts near its minimum
// Seeds of a CVT are as dense as this power of the density, 3 / (3 + 2) in space.
constexpr double kSeedExponent = 0.6;

// The sites of the next finer level, as far as the middles of edges and the corners of cells give as many.
std::vector<Vec3> refined(SolidBackend& backend, const std::vector<Vec3>& seeds, std::size_t count) {
  CellMoments moments;
  RestrictedPolygons polygons;
  ClippedPolyhedra polyhedra;
  backend.evaluate(seeds, moments, polygons, polyhedra);
  return refine_sites(polyhedra, moments, seeds, count);
}

// Random sites up to `count`: all of them at first, and some where the solid is thin, whose cells have few neighbours.
void fill_up(const Solid& solid, std::size_t count, std::uint64_t random_seed, std::vector<Vec3>& seeds) {
  if (seeds.size() >= count) return;
  std::vector<double> weight = solid.density;
  for (double& rho : weight) rho = std::pow(rho, kSeedExponent);
  const std::vector<Vec3> more = sample_solid(solid.mesh, count - seeds.size(), random_seed, weight);
  seeds.insert(seeds.end(), more.begin(), more.end());
}

}  // namespace

std::vector<Vec3> free_phase(TetRun& run, StandIns& stand_ins) {
  const TetOptions& options = run.options;
  const std::vector<std::size_t> counts =
      options.seeds.empty() ? tet_level_counts(run.wanted) : std::vector<std::size_t>{options.seeds.size()};
  std::vector<Vec3> seeds = options.seeds;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    SolidBackend* const stand_in = stand_ins.choose(counts[level], counts.back(), run.solid);
    SolidBackend& backend = stand_in ? *stand_in : run.solid;
    if (level > 0) seeds = refined(backend, seeds, counts[level]);
    fill_up(backend.solid(), counts[level], options.random_seed + level, seeds);
    CvtState state = inner_sites(std::move(seeds));
    const bool finest = level > 0 && level + 1 == counts.size();
    optimise_sites(run, backend, state, counts.size() > 1 ? fmt::format("free, level {}/{}", level + 1, counts.size()) : "free",
                   finest ? kFinestShare : kLevelShare, false);
    seeds = std::move(state.seeds);
  }
  return seeds;
}

}  // namespace bisector
