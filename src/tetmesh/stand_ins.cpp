#include "tetmesh/stand_ins.h"

#include <utility>

#include "bisector/error.h"
#include "compute/compute.h"
#include "remesh/coarse_surface.h"
#include "tetmesh/check_surface.h"
#include "tetmesh/tet_sizing.h"
#include "tetmesh/tetgen.h"

namespace bisector {
namespace {

constexpr std::size_t kManyTets = 8;  // tetrahedra of the solid for each site, from which on a stand-in pays

// Without word of what goes on.
Context quiet(Context context) {
  context.progress = nullptr;
  context.warning = nullptr;
  return context;
}

}  // namespace

// A solid and what computes its diagrams.
struct StandIns::Domain {
  Domain(TetMesh mesh, std::vector<double> density, Compute& compute)
      : solid(std::move(mesh), std::move(density)), backend(compute.backend(solid)) {}

  Solid solid;
  std::unique_ptr<SolidBackend> backend;
};

StandIns::StandIns(const TetMesh& mesh, const TriangleMesh& surface, Backend& boundary, const FeatureGraph& features,
                   const TetOptions& options, const SizeField* bound, Compute& compute, const Context& context)
    : mesh_(mesh), surface_(surface), boundary_(boundary), features_(features), options_(options), bound_(bound),
      compute_(compute), context_(context) {}

StandIns::~StandIns() = default;

SolidBackend* StandIns::choose(std::size_t count, std::size_t final_count, double edge_length,
                               const SolidBackend& whole) {
  if (!whole.solid().density.empty()) {
    if (count == final_count) return nullptr;
    domain_ = make_sized(count);
    return domain_->backend.get();
  }
  if (whole.solid().mesh.tets.size() < kManyTets * final_count) return nullptr;
  if (!std::exchange(tried_, true)) domain_ = make_coarse(edge_length);
  return domain_ ? domain_->backend.get() : nullptr;
}

SolidBackend* StandIns::coarse() {
  return domain_ && domain_->solid.density.empty() ? domain_->backend.get() : nullptr;
}

SolidBackend* StandIns::within(const TriangleMesh& boundary, std::size_t count, const SolidBackend& whole) {
  within_.reset();
  if (!whole.solid().density.empty() || whole.solid().mesh.tets.size() < kManyTets * count || find_tetgen().empty())
    return nullptr;
  within_ = make_within(boundary);
  return within_ ? within_->backend.get() : nullptr;
}

// The solid refined only as far as `count` sites ask for.
std::unique_ptr<StandIns::Domain> StandIns::make_sized(std::size_t count) const {
  SizingTarget target;
  target.vertices = count;
  SizedSolid sized = refine_for_sizes(mesh_, surface_, options_.sizing, target, bound_);
  std::vector<double> density = sized.volume_density();
  return std::make_unique<Domain>(std::move(sized.mesh), std::move(density), compute_);
}

// The inside of a coarser boundary. There is none where that does not bound a solid, or without TetGen.
std::unique_ptr<StandIns::Domain> StandIns::make_coarse(double edge_length) const {
  if (find_tetgen().empty()) return nullptr;
  const CoarseSurface coarse = coarse_surface(boundary_.surface(), features_, edge_length);
  return coarse.surface ? make_within(coarse.surface->mesh) : nullptr;
}

std::unique_ptr<StandIns::Domain> StandIns::make_within(const TriangleMesh& boundary) const {
  try {
    return std::make_unique<Domain>(tetgen_tets(check_surface(boundary), {}, quiet(context_)).mesh,
                                    std::vector<double>{}, compute_);
  } catch (const DeviceError&) {
    throw;
  } catch (const Error&) {
    return nullptr;
  }
}

}  // namespace bisector
