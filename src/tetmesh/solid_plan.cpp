#include "tetmesh/solid_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "remesh/detail.h"
#include "remesh/sizing.h"

namespace bisector {
namespace {

// `plan.sized` is the solid refined for sizes without details.
void plan_surface(const TriangleMesh& surface, const SurfaceOf& surface_of, const TetOptions& options,
                  SolidPlan& plan) {
  const SizedSolid& plain = plan.sized;
  std::vector<double> lengths(surface.vertices.size(), plain.edge_length);
  std::copy_n(plain.lengths.begin(), std::min(plain.lengths.size(), lengths.size()), lengths.begin());
  const MeshEstimate without = estimate_mesh(surface_of(plain.mesh), {plain.surface_density(), plain.edge_length});
  DetailPlan detail = plan_details(surface, plan.features, lengths, static_cast<std::size_t>(without.vertices),
                                   options.detail == DetailMode::all);
  plan.features = std::move(detail.features);
  plan.detail = detail.result;
  if (!detail.points.empty()) plan.bound.emplace(detail.points, detail.lengths, options.sizing.field.gradation);
}

}  // namespace

SolidPlan plan_solid(const TetMesh& mesh, const TriangleMesh& surface, const SurfaceOf& surface_of,
                     const TetOptions& options) {
  const SizingTarget target = options.seeds.empty() ? SizingTarget{options.vertices, options.edge_length}
                                                    : SizingTarget{options.seeds.size(), 0};
  SolidPlan plan;
  plan.sized = refine_for_sizes(mesh, surface, options.sizing, target);
  plan.features = detect_features(surface, options.features);
  if (options.detail != DetailMode::off && options.seeds.empty()) plan_surface(surface, surface_of, options, plan);
  if (plan.bound)
    plan.sized =
        refine_for_sizes(mesh, surface, options.sizing, target, plan.bounds(), options.detail == DetailMode::all);
  if (plan.sized.vertices < kFewest)
    throw Error(fmt::format("edges of {:.6g} make {} vertices, fewer than {}; ask for shorter ones",
                            options.edge_length, plan.sized.vertices, kFewest));
  return plan;
}

}  // namespace bisector
