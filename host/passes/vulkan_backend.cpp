#include "host/passes/vulkan_backend.h"

#include "backend/cpu_backend.h"
#include "core/stopwatch.h"
#include "host/passes/cell_pass.h"
#include "host/passes/device_backend.h"
#include "host/passes/surface_stage.h"

namespace bisector::host {
namespace {

class VulkanBackend : public DeviceBackend<Backend, CpuBackend> {
 public:
  VulkanBackend(const Surface& surface, std::shared_ptr<Device> device, const VulkanOptions& options,
                const Precisions& precisions);

 private:
  DiagramWorkOnDevice compute_on_device(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override;
  void learn_speed(std::size_t pairs, double seconds) override { pairs_.learn_speed(pairs, seconds); }
  void find_moments(bool with_triangles, CellMoments& moments, Certification& certification);

  SurfaceStage pairs_;
  CellPass cells_;
};

VulkanBackend::VulkanBackend(const Surface& surface, std::shared_ptr<Device> device, const VulkanOptions& options,
                             const Precisions& precisions)
    : DeviceBackend(surface, std::move(device), precisions, options.neighbours, device_scale(surface), surface.box,
                    false),
      pairs_(stage_, surface, options.capacities), cells_(stage_.device(), stage_.is_double(), false) {
  std::vector<Index> triangles;
  for (const FacetSummary& summary : surface.summaries) triangles.push_back(summary.triangle);
  cells_.set_elements(stage_.commands, triangles, surface.facet_of.size());
  stage_.commands.run();
}

DiagramWorkOnDevice VulkanBackend::compute_on_device(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) {
  DiagramWorkOnDevice work;
  Stopwatch watch;
  pairs_.find_owners(seeds);
  work.searched = watch.lap();
  find_moments(includes(want, Want::triangles), diagram.moments, work.certification);
  stage_.complete_step_masses(diagram.moments);
  work.clipped = watch.lap();
  if (includes(want, Want::labels)) pairs_.polygons(includes(want, Want::polygons), diagram.polygons);
  return work;
}

void VulkanBackend::find_moments(bool with_triangles, CellMoments& moments, Certification& certification) {
  pairs_.find_pairs(certification);
  find_cells(stage_, cells_, pairs_.store(), {mass(), mass()}, with_triangles, moments,
             [&](float share) { return pairs_.refine(cells_.cells(), share, certification); });
  certification.pairs = cells_.items();
}

}  // namespace

std::unique_ptr<Backend> make_vulkan_backend(const Surface& surface, std::shared_ptr<Device> device,
                                             const VulkanOptions& options) {
  const Precisions precisions = choose_precisions(*device, options.precision, options.double_rung);
  return std::make_unique<VulkanBackend>(surface, std::move(device), options, precisions);
}

}  // namespace bisector::host
