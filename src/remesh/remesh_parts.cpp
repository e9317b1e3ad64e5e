#include "remesh/remesh_parts.h"

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "compute/compute.h"
#include "core/stopwatch.h"
#include "cvt/optimise.h"
#include "distributed/distributed_backend.h"
#include "mesh/topology.h"
#include "remesh/remesh.h"
#include "remesh/topology_control.h"
#include "voronoi/dual.h"

namespace bisector {
namespace {

// Of the whole run; reading comes before.
constexpr double kShareOfStandIn = 0.4;

// Those of the run, or this process alone.
class RanksOfRun {
 public:
  RanksOfRun() {
    if (!ranks_of_run()) alone_.emplace(one_);
  }
  Ranks& get() { return alone_ ? *alone_ : *ranks_of_run(); }

 private:
  OneRank one_;
  std::optional<Ranks> alone_;
};

// Seeds that are well placed on what stands in.
std::vector<Vec3> first_seeds(TriangleMesh stand_in, const RemeshOptions& options, Ranks& ranks, const Context& context,
                              PartsResult& result) {
  const Surface surface(std::move(stand_in));
  const MakeBackend make_backend = [&](const Surface& domain) -> std::unique_ptr<Backend> {
    return std::make_unique<DistributedBackend>(domain, options.compute.neighbours, ranks);
  };
  RemeshPlan plan = plan_of(options);
  plan.topology = TopologyControl::off;
  plan.min_angle = 0;
  plan.fit = false;
  Context on_stand_in = context;
  if (context.progress)
    on_stand_in.progress = [tell = context.progress](Progress p) {
      p.phase = "stand-in, " + p.phase;
      p.fraction *= kShareOfStandIn;
      tell(p);
    };
  const std::unique_ptr<Backend> backend = make_backend(surface);
  RemeshResult placed = remesh(*backend, {}, plan, on_stand_in, make_backend);
  result.iterations += placed.iterations;
  return std::move(placed.mesh.vertices);
}

}  // namespace

PartsResult remesh_parts(const std::string& path, const RemeshOptions& options, const Context& context) {
  if (options.vertices < 4) throw Error("a surface takes at least 4 vertices; ask for more");
  PartsResult result;
  RanksOfRun ranks;
  Stopwatch watch;
  FileOfRanks file = read_on_all(path, options.vertices, ranks.get());
  DistributedBackend backend(file, options.compute.neighbours, ranks.get());
  result.input_vertices = file.vertices;
  result.input_triangles = file.triangles;
  result.area = file.area;
  result.stand_in_triangles = file.stand_in.triangles.size();
  result.seconds_reading = watch.lap();
  context.check();
  std::vector<Vec3> seeds = first_seeds(std::move(file.stand_in), options, ranks.get(), context, result);
  result.seconds_stand_in = watch.lap();

  const FeatureGraph no_features;
  const FeatureCurves no_curves(no_features, {});
  CvtRun run(backend, no_curves, context);
  run.seeds = PlacedSeeds(std::move(seeds));
  OptimiseOptions step;
  step.iterations = std::min(options.iterations, kIterationsOnAll);
  step.tolerance = options.tolerance;
  step.constrained = plan_of(options).constrained;
  step.phase = "whole surface";
  step.done = kShareOfStandIn;
  step.share = 1 - kShareOfStandIn;
  optimise(run, step);
  result.iterations_on_all = run.totals.iterations;
  result.iterations += run.totals.iterations;
  result.energy = run.energy;

  Diagram diagram;
  result.certification = backend.evaluate(run.seeds.positions(), Want::dual, diagram).certification;
  result.ranks = backend.figures();
  for (const PartFigures& of_rank : result.ranks) result.untiled += of_rank.untiled;
  result.mesh = dual_mesh(run.seeds.positions(), diagram.dual);
  result.topology = analyse_topology(result.mesh.triangles, result.mesh.vertices.size());
  result.device = backend.description();
  result.seconds_on_all = watch.lap();
  return result;
}

}  // namespace bisector
