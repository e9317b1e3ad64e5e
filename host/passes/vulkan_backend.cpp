#include "host/passes/vulkan_backend.h"

#include <functional>
#include <optional>

#include "backend/cpu_backend.h"
#include "core/stopwatch.h"
#include "host/passes/cell_pass.h"
#include "host/passes/device_backend.h"
#include "host/passes/device_descent.h"
#include "host/passes/surface_stage.h"

namespace bisector::host {
namespace {

class VulkanBackend : public DeviceBackend<Backend, CpuBackend> {
 public:
  VulkanBackend(const Surface& surface, std::shared_ptr<Device> device, const VulkanOptions& options,
                const Precisions& precisions);

 private:
  DiagramWorkOnDevice compute_on_device(Want want, Diagram& diagram) override;
  void learn_speed(std::size_t pairs, double seconds) override { pairs_.learn_speed(pairs, seconds); }
  std::unique_ptr<ResidentDescent> descend(const DescentStart& start) override;
  using ReadMass = std::function<std::optional<double>()>;
  DiagramWorkOnDevice find_cells(const ReadMass& read);

  SurfaceStage pairs_;
  CellPass cells_;
};

VulkanBackend::VulkanBackend(const Surface& surface, std::shared_ptr<Device> device, const VulkanOptions& options,
                             const Precisions& precisions)
    : DeviceBackend(surface, std::move(device), precisions, options, device_scale(surface), surface.box, false),
      pairs_(stage_, surface, options.capacities), cells_(stage_.device(), stage_.is_double(), false) {
  std::vector<Index> triangles;
  for (const FacetSummary& summary : surface.summaries) triangles.push_back(summary.triangle);
  cells_.set_elements(stage_.commands, triangles, surface.facet_of.size());
  stage_.commands.run();
}

DiagramWorkOnDevice VulkanBackend::compute_on_device(Want want, Diagram& diagram) {
  CellMoments& moments = diagram.moments;
  DiagramWorkOnDevice work = find_cells([&]() -> std::optional<double> {
    if (!cells_.read(stage_, includes(want, Want::triangles), moments)) return {};
    return moments.mass;
  });
  const Stopwatch watch;
  stage_.complete_step_masses(moments);
  work.clipped += watch.seconds();
  if (includes(want, Want::labels)) pairs_.polygons(includes(want, Want::polygons), diagram.polygons);
  return work;
}

DiagramWorkOnDevice VulkanBackend::find_cells(const ReadMass& read) {
  DiagramWorkOnDevice work;
  Stopwatch watch;
  pairs_.find_owners();
  work.searched = watch.lap();
  pairs_.find_pairs(work.certification);
  host::find_cells(stage_, cells_, pairs_.store(), {mass(), mass()}, read,
                   [&](float share) { return pairs_.refine(cells_.cells(), share, work.certification); });
  work.certification.pairs = cells_.items();
  work.clipped = watch.lap();
  return work;
}

std::unique_ptr<ResidentDescent> VulkanBackend::descend(const DescentStart& start) {
  if (!DeviceDescent::is_possible(stage_, pairs_, start)) return nullptr;
  const auto evaluate = [this](const std::function<void()>& begin, const ReadMass& read) {
    return run(begin, [&] { return find_cells(read); });
  };
  std::unique_ptr<DeviceDescent> descent;
  try {
    descent = std::make_unique<DeviceDescent>(stage_, pairs_, cells_, start, evaluate);
  } catch (const DeviceError&) {
    // There is no memory for the vectors; the host has some.
    return nullptr;
  }
  descent->begin(start);
  return descent;
}

}  // namespace

std::unique_ptr<Backend> make_vulkan_backend(const Surface& surface, std::shared_ptr<Device> device,
                                             const VulkanOptions& options) {
  const Precisions precisions = choose_precisions(*device, options.precision, options.double_rung);
  return std::make_unique<VulkanBackend>(surface, std::move(device), options, precisions);
}

}  // namespace bisector::host
