// A device for as long as it works, then the CPU.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "bisector/context.h"

namespace bisector {

// The first DeviceError of the device drops it, with one warning, and the same seeds are evaluated on the CPU: an
// evaluation depends on its seeds alone, so none is lost and the run goes on from where it was; a descent on the device
// goes on from the seeds that it kept last. Base is Backend or SolidBackend.
template <class Base>
class FallbackOf : public Base {
 public:
  BackendDescription description() const override { return backend_->description(); }
  double mass_tolerance() const override { return backend_->mass_tolerance(); }
  // The device's even after it was dropped: its last energies are still compared with.
  double energy_noise() const override { return energy_noise_; }
  std::unique_ptr<ResidentDescent> descend(const DescentStart& start) override;
  void give_up(const DeviceError& error) override;

 protected:
  // `on_cpu` makes the backend for the CPU, given the reason.
  template <class Domain>
  FallbackOf(const Domain& domain, std::unique_ptr<Base>&& device,
             std::function<std::unique_ptr<Base>(const std::string& reason)> on_cpu, Context context);

  EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override;

 private:
  std::function<std::unique_ptr<Base>(const std::string&)> on_cpu_;
  Context context_;
  double energy_noise_;
  std::unique_ptr<Base> backend_;
};

class FallbackBackend : public FallbackOf<Backend> {
 public:
  FallbackBackend(std::unique_ptr<Backend> device, NeighbourSource source, Context context);
};

class FallbackSolidBackend : public FallbackOf<SolidBackend> {
 public:
  FallbackSolidBackend(std::unique_ptr<SolidBackend> device, NeighbourSource source, Context context);
};

}  // namespace bisector
