// The optimisation loop: minimises the CVT energy F = sum_i int rho |x - x_i|^2 by L-BFGS (thesis 4.4.2; Liu et al. 2009).
#pragma once

#include <string>
#include <vector>

#include "bisector/context.h"
#include "backend/backend.h"
#include "features/curves.h"

namespace bisector {

struct OptimiseOptions {
  int iterations = 100;        // accepted steps at most
  double tolerance = 1e-6;     // stop when the energy falls by less than this share per step, over five steps
  bool constrained = false;    // CCVT: seeds stay on the surface, gradients in its tangent planes
  const FeatureCurves* curves = nullptr;  // that places refer to; needed if a seed is on one
  std::string phase;           // for progress
  double done = 0, share = 1;  // of the whole run: fraction before this optimisation, and its own
};

struct OptimiseTotals {
  int iterations = 0;
  int evaluations = 0;
  DiagramSeconds seconds;
  double seconds_lbfgs = 0;

  void count(const CellMoments& moments);
};

// Seeds with all that is known about their diagram. `moments`, `gradient` and `energy` belong to `seeds`.
struct CvtState {
  std::vector<Vec3> seeds;
  std::vector<SeedPlace> places;  // of each seed, or empty: all on the surface
  CellMoments moments;
  std::vector<Vec3> gradient;  // dF/dx_i = 2 m_i (x_i - c_i); its part along what the seed is held on
  std::vector<Vec3> normals;   // of the surface at each seed, if constrained
  double energy = 0;
  double gradient_norm = 0;
};

// Moves state.seeds downhill along their places; reads nothing else of the state, and leaves it complete. Seeds on the surface
// whose cells are empty are put where the energy is highest. Throws Cancelled between evaluations, and Error if a diagram does not cover the surface.
void optimise(Backend& backend, CvtState& state, const OptimiseOptions& options, OptimiseTotals& totals,
              const Context& context);

// Completes the state for its seeds and places as they are.
void complete(Backend& backend, CvtState& state, const OptimiseOptions& options, OptimiseTotals& totals);

}  // namespace bisector
