#include "host/passes/device_backend.h"

#include <cmath>

namespace bisector::host {

double mass_tolerance_of(bool is_double) { return is_double ? 1e-12 : 1e-6; }

// Energies are sums of terms that are off by a few units of 2^-24 each, mostly at random.
double energy_noise_of(bool is_double) { return is_double ? 0 : 1e-7; }

void refine_masses(double mass, const CellMoments& moments, const std::function<std::size_t(float)>& refine,
                   const std::function<void()>& sum) {
  // With the last share everything that is in any doubt climbs.
  for (const float share : {1.0f, 0.05f, 0.0f}) {
    if (refine(share) > 0) sum();
    if (std::abs(moments.mass - mass) <= mass_tolerance_of(false) * mass) return;
  }
}

}  // namespace bisector::host
