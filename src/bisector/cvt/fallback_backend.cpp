#include "bisector/cvt/fallback_backend.h"

#include <utility>

#include "bisector/core/error.h"
#include "bisector/cvt/cpu_backend.h"

namespace bisector {

FallbackBackend::FallbackBackend(std::unique_ptr<Backend> device, NeighbourSource source, Context context)
    : surface_(device->surface()), source_(source), context_(std::move(context)), energy_noise_(device->energy_noise()),
      backend_(std::move(device)) {}

template <class Evaluation>
void FallbackBackend::attempt(const Evaluation& evaluation) {
  if (on_device_) try {
      return evaluation(*backend_);
    } catch (const DeviceError& error) {
      const std::string reason = error.what();
      on_device_ = false;
      backend_ = std::make_unique<CpuBackend>(surface_, source_, reason);
      context_.warn("going on with the CPU because of this: " + reason);
    }
  evaluation(*backend_);
}

void FallbackBackend::evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) {
  attempt([&](Backend& backend) { backend.evaluate(seeds, moments); });
}

void FallbackBackend::evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) {
  attempt([&](Backend& backend) { backend.evaluate(seeds, moments, polygons); });
}

}  // namespace bisector
