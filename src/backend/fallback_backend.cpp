#include "backend/fallback_backend.h"

#include <utility>

#include "backend/cpu_backend.h"

namespace bisector {

FallbackBackend::FallbackBackend(std::unique_ptr<Backend> device, NeighbourSource source, Context context)
    : surface_(device->surface()),
      fallback_(
          std::move(device),
          [&surface = surface_, source](const std::string& reason) {
            return std::make_unique<CpuBackend>(surface, source, reason);
          },
          std::move(context)) {}

FallbackSolidBackend::FallbackSolidBackend(std::unique_ptr<SolidBackend> device, NeighbourSource source, Context context)
    : solid_(device->solid()),
      fallback_(
          std::move(device),
          [&solid = solid_, source](const std::string& reason) {
            return std::make_unique<CpuSolidBackend>(solid, source, InnerCells::whole, reason);
          },
          std::move(context)) {}

}  // namespace bisector
