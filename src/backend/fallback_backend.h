// A device for as long as it works, then the CPU.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "bisector/context.h"
#include "bisector/error.h"
#include "backend/backend.h"
#include "backend/solid_backend.h"

namespace bisector {

// The first DeviceError of the device drops it, with one warning, and the same seeds are evaluated on the CPU: an evaluation
// depends on its seeds alone, so none is lost and the run goes on from where it was.
template <class Kind>
class Fallback {
 public:
  // `on_cpu` makes the backend for the CPU, given the reason.
  Fallback(std::unique_ptr<Kind> device, std::function<std::unique_ptr<Kind>(const std::string&)> on_cpu, Context context)
      : on_cpu_(std::move(on_cpu)), context_(std::move(context)), energy_noise_(device->energy_noise()),
        backend_(std::move(device)) {}

  const Kind& backend() const { return *backend_; }
  // The device's even after it was dropped: its last energies are still compared with.
  double energy_noise() const { return energy_noise_; }
  template <class... Arguments>
  void evaluate(Arguments&... arguments) {
    if (on_device_) try {
        return backend_->evaluate(arguments...);
      } catch (const DeviceError& error) {
        const std::string reason = error.what();
        on_device_ = false;
        backend_ = on_cpu_(reason);
        context_.warn("going on with the CPU because of this: " + reason);
      }
    backend_->evaluate(arguments...);
  }

 private:
  std::function<std::unique_ptr<Kind>(const std::string&)> on_cpu_;
  Context context_;
  double energy_noise_;
  std::unique_ptr<Kind> backend_;
  bool on_device_ = true;
};

class FallbackBackend : public Backend {
 public:
  // The device's surface must outlive the backend.
  FallbackBackend(std::unique_ptr<Backend> device, NeighbourSource source, Context context);

  const Surface& surface() const override { return surface_; }
  BackendDescription description() const override { return fallback_.backend().description(); }
  double mass_tolerance() const override { return fallback_.backend().mass_tolerance(); }
  double energy_noise() const override { return fallback_.energy_noise(); }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) override { fallback_.evaluate(seeds, moments); }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) override {
    fallback_.evaluate(seeds, moments, polygons);
  }

 private:
  const Surface& surface_;
  Fallback<Backend> fallback_;
};

class FallbackSolidBackend : public SolidBackend {
 public:
  // The device's solid must outlive the backend.
  FallbackSolidBackend(std::unique_ptr<SolidBackend> device, NeighbourSource source, Context context);

  const Solid& solid() const override { return solid_; }
  BackendDescription description() const override { return fallback_.backend().description(); }
  double mass_tolerance() const override { return fallback_.backend().mass_tolerance(); }
  double energy_noise() const override { return fallback_.energy_noise(); }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) override { fallback_.evaluate(seeds, moments); }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) override {
    fallback_.evaluate(seeds, moments, polygons);
  }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons,
                ClippedPolyhedra& polyhedra) override {
    fallback_.evaluate(seeds, moments, polygons, polyhedra);
  }

 private:
  const Solid& solid_;
  Fallback<SolidBackend> fallback_;
};

}  // namespace bisector
