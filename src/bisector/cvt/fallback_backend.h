// A device for as long as it works, then the CPU.
#pragma once

#include <memory>

#include "bisector/core/context.h"
#include "bisector/cvt/backend.h"

namespace bisector {

// The first DeviceError of the device drops it, with one warning, and the same seeds are evaluated on the CPU: an evaluation
// depends on its seeds alone, so none is lost and the run goes on from where it was.
class FallbackBackend : public Backend {
 public:
  // The device's surface must outlive the backend.
  FallbackBackend(std::unique_ptr<Backend> device, NeighbourSource source, Context context);

  const Surface& surface() const override { return surface_; }
  BackendDescription description() const override { return backend_->description(); }
  double mass_tolerance() const override { return backend_->mass_tolerance(); }
  // The device's even after it was dropped: its last energies are still compared with.
  double energy_noise() const override { return energy_noise_; }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) override;
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) override;

 private:
  template <class Evaluation>
  void attempt(const Evaluation& evaluation);

  const Surface& surface_;
  NeighbourSource source_;
  Context context_;
  double energy_noise_;
  std::unique_ptr<Backend> backend_;
  bool on_device_ = true;
};

}  // namespace bisector
