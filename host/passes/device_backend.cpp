#include "host/passes/device_backend.h"

#include <cmath>
#include <iterator>

namespace bisector::host {

double mass_tolerance_of(bool is_double) { return is_double ? 1e-12 : 1e-6; }

// Energies are sums of terms that are off by a few units of 2^-24 each, mostly at random.
double energy_noise_of(bool is_double) { return is_double ? 0 : 1e-7; }

double total(const DeviceSeconds& seconds) {
  return seconds.transfer + seconds.grid + seconds.neighbours + seconds.owners + seconds.clip + seconds.sort +
         seconds.sum + seconds.descent;
}

void find_cells(SeedStage& stage, CellPass& cells, const PairStore& store, const ExpectedMass& mass,
                const std::function<std::optional<double>()>& read, const std::function<std::size_t(float)>& refine) {
  // With the last share everything that is in any doubt climbs.
  constexpr float kShares[] = {1.0f, 0.05f, 0.0f};
  const bool refines = !stage.is_double();
  std::optional<double> sum;
  while (!sum) {
    cells.record(stage, store);
    if (refines && refine(kShares[0]) > 0) cells.sum(stage, store);
    sum = read();
  }
  for (std::size_t k = 1; refines && k < std::size(kShares); ++k) {
    if (std::abs(*sum - mass.of_cells) <= mass_tolerance_of(false) * mass.of_domain) return;
    if (refine(kShares[k]) == 0) continue;
    cells.sum(stage, store);
    sum = read();
  }
}

}  // namespace bisector::host
