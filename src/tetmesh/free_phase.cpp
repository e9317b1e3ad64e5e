#include "tetmesh/free_phase.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "tetmesh/sample_solid.h"
#include "tetmesh/tet_levels.h"

namespace bisector {
namespace {

// Shares of the steps that the whole run is allowed.
constexpr double kLevelShare = 0.35;  // on the only level, and on each of the coarser ones
constexpr double kFinestShare = 0.2;  // on the finest of several levels, which starts near its minimum
// Seeds of a CVT are as dense as this power of the density, 3 / (3 + 2) in space.
constexpr double kSeedExponent = 0.6;

// Random sites up to `count`: all of them at first, and some where the solid is thin, whose cells have few neighbours.
void fill_up(const Solid& solid, std::size_t count, std::uint64_t random_seed, std::vector<Vec3>& sites) {
  if (sites.size() >= count) return;
  std::vector<double> weight = solid.density;
  for (double& rho : weight) rho = std::pow(rho, kSeedExponent);
  const std::vector<Vec3> more = sample_solid(solid.mesh, count - sites.size(), random_seed, weight);
  sites.insert(sites.end(), more.begin(), more.end());
}

}  // namespace

void free_phase(TetRun& run, StandIns& stand_ins) {
  const TetOptions& options = run.options;
  const std::vector<std::size_t> counts =
      options.seeds.empty() ? tet_level_counts(run.wanted) : std::vector<std::size_t>{options.seeds.size()};
  std::vector<Vec3> sites = options.seeds;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    SolidBackend* const stand_in = stand_ins.choose(counts[level], counts.back(), run.sized.edge_length, run.solid);
    SolidBackend& solid = stand_in ? *stand_in : run.solid;
    run.sites.change_backend(solid);
    if (level > 0)
      sites =
          refine_sites(run.sites.diagram(Want::polygons | Want::polyhedra), run.sites.seeds.positions(), counts[level]);
    fill_up(solid.solid(), counts[level], options.random_seed + level, sites);
    run.sites.seeds = PlacedSeeds(std::move(sites), {SeedPlace::Kind::interior});
    const bool finest = level > 0 && level + 1 == counts.size();
    optimise_sites(run, counts.size() > 1 ? fmt::format("free, level {}/{}", level + 1, counts.size()) : "free",
                   finest ? kFinestShare : kLevelShare, false);
  }
  run.sites.change_backend(run.solid);
}

}  // namespace bisector
