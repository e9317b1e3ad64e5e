#include "backend/fallback_backend.h"

#include <utility>

#include "backend/cpu_backend.h"
#include "bisector/error.h"

namespace bisector {

template <class Base>
template <class Domain>
FallbackOf<Base>::FallbackOf(const Domain& domain, std::unique_ptr<Base>&& device,
                             std::function<std::unique_ptr<Base>(const std::string&)> on_cpu, Context context)
    : Base(domain), on_cpu_(std::move(on_cpu)), context_(std::move(context)), energy_noise_(device->energy_noise()),
      backend_(std::move(device)) {}

template <class Base>
EvaluationReport FallbackOf<Base>::compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) {
  try {
    return backend_->evaluate(seeds, want, diagram);
  } catch (const DeviceError& error) {
    give_up(error);
  }
  return backend_->evaluate(seeds, want, diagram);
}

template <class Base>
std::unique_ptr<ResidentDescent> FallbackOf<Base>::descend(const DescentStart& start) {
  try {
    return backend_->descend(start);
  } catch (const DeviceError& error) {
    give_up(error);
  }
  return nullptr;
}

template <class Base>
void FallbackOf<Base>::give_up(const DeviceError& error) {
  const std::string reason = error.what();
  backend_ = on_cpu_(reason);
  context_.warn("going on with the CPU because of this: " + reason);
}

template class FallbackOf<Backend>;
template class FallbackOf<SolidBackend>;

FallbackBackend::FallbackBackend(std::unique_ptr<Backend> device, NeighbourSource source, Context context)
    : FallbackOf(
          device->surface(), std::move(device),
          [&surface = device->surface(), source](const std::string& reason) {
            return std::make_unique<CpuBackend>(surface, source, reason);
          },
          std::move(context)) {}

FallbackSolidBackend::FallbackSolidBackend(std::unique_ptr<SolidBackend> device, NeighbourSource source,
                                           Context context)
    : FallbackOf(
          device->solid(), std::move(device),
          [&solid = device->solid(), source](const std::string& reason) {
            return std::make_unique<CpuSolidBackend>(solid, source, SolidCells::whole, reason);
          },
          std::move(context)) {}

}  // namespace bisector
