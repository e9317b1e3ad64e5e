// What the backends of surfaces and of solids on a device share.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "backend/backend.h"
#include "core/stopwatch.h"
#include "host/passes/cell_pass.h"
#include "host/passes/seed_stage.h"

namespace bisector::host {

// By how much, relative to the whole, rounding may make the sum of all masses miss the domain's, and energies compare
// wrongly.
double mass_tolerance_of(bool is_double);
double energy_noise_of(bool is_double);

double total(const DeviceSeconds& seconds);

// What the masses of cells that a device computes sum to, and the domain's, which tolerances are relative to.
struct ExpectedMass {
  double of_cells, of_domain;
};

// Sums over the cells of all pairs. `read` runs that and returns the sum of the masses; nothing if all has to be
// recorded again. In single precision pairs of cells whose masses are not certain enough are taken to the next rungs,
// and more of them for as long as the masses do not sum to what is expected: `refine` does so with a share of the
// errors that are allowed and returns how many pairs there were.
void find_cells(SeedStage& stage, CellPass& cells, const PairStore& store, const ExpectedMass& mass,
                const std::function<std::optional<double>()>& read,
                const std::function<std::size_t(float share)>& refine);

// How a diagram came about: its certification, and the seconds on the host of the search for owners, the pairs of a
// solid's boundary, and clipping.
struct DiagramWorkOnDevice {
  Certification certification;
  double searched = 0, paired = 0, clipped = 0;
};

// Base is Backend or SolidBackend, and Cpu the twin on the CPU, which computes what is out of the device's reach.
template <class Base, class Cpu>
class DeviceBackend : public Base {
 public:
  BackendDescription description() const override { return stage_.description(); }
  double mass_tolerance() const override { return mass_tolerance_of(stage_.is_double()); }
  double energy_noise() const override { return energy_noise_of(stage_.is_double()); }

 protected:
  // `scale` and `box` are the domain's; `cpu` are what Cpu is made of beside the domain and the source.
  template <class Domain, class... CpuOptions>
  DeviceBackend(const Domain& domain, std::shared_ptr<Device> device, const Precisions& precisions,
                const VulkanOptions& options, double scale, const Box& box, bool in_solid, CpuOptions... cpu)
      : Base(domain), stage_(std::move(device), precisions, options, scale, box, in_solid),
        cpu_(domain, options.neighbours, cpu...) {}

  EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) final {
    if (!stage_.within_reach(seeds)) {
      EvaluationReport report = cpu_.evaluate(seeds, want, diagram);
      report.certification.cpu = report.certification.pairs;
      return report;
    }
    return run([&] { stage_.begin(seeds); }, [&] { return compute_on_device(want, diagram); });
  }
  // An evaluation of the seeds that `begin` gives to the seed stage.
  EvaluationReport run(const std::function<void()>& begin, const std::function<DiagramWorkOnDevice()>& compute) {
    const Stopwatch watch;
    begin();
    const DiagramWorkOnDevice work = compute();
    DiagramSeconds seconds;
    (stage_.delaunay() ? seconds.delaunay : seconds.neighbours) = stage_.lists_seconds();
    seconds.neighbours += work.searched;
    seconds.pairs = work.paired;
    seconds.clip = work.clipped;
    seconds.device = stage_.commands.take_seconds();
    learn_speed(work.certification.pairs, seconds.device.clip);
    DeviceWork device_work = stage_.commands.take_work();
    device_work.host_seconds = std::max(watch.seconds() - total(seconds.device), 0.0);
    return {work.certification, seconds, device_work};
  }
  // How long the device took to clip so many pairs.
  virtual void learn_speed(std::size_t pairs, double seconds) = 0;
  // The seed stage has begun with the seeds.
  virtual DiagramWorkOnDevice compute_on_device(Want want, Diagram& diagram) = 0;

  SeedStage stage_;

 private:
  Cpu cpu_;
};

}  // namespace bisector::host
