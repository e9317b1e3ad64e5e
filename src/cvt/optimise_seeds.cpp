#include <memory>
#include <optional>

#include "bisector/cvt.h"
#include "bisector/error.h"
#include "compute/compute.h"
#include "core/parallel.h"
#include "cvt/optimise.h"

namespace bisector {

CvtResult optimise_seeds(const TriangleMesh& mesh, const std::vector<double>& density, const std::vector<Vec3>& seeds,
                         const CvtOptions& options, const Context& context) {
  if (seeds.empty()) throw Error("there are no seeds to optimise; give at least one");
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  const Surface surface(mesh, density);
  const std::unique_ptr<Backend> backend = make_backend(surface, options.compute, context);
  const FeatureCurves no_curves;
  CvtRun run(*backend, no_curves, context);
  run.seeds = PlacedSeeds(seeds);
  OptimiseOptions step;
  step.iterations = options.iterations;
  step.tolerance = options.tolerance;
  step.constrained = options.constrained;
  step.phase = "optimising";
  optimise(run, step);
  return {run.seeds.positions(), run.energy, run.gradient_norm, run.totals.iterations, run.totals.evaluations,
          backend->description()};
}

}  // namespace bisector
