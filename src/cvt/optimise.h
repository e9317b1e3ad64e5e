// The optimisation loop: minimises the CVT energy F = sum_i int rho |x - x_i|^2 by L-BFGS (thesis 4.4.2; Liu et al.
// 2009).
#pragma once

#include <string>
#include <vector>

#include "cvt/run.h"

namespace bisector {

struct OptimiseOptions {
  int iterations = 100;        // accepted steps at most
  double tolerance = 1e-6;     // stop when the energy falls by less than this share per step, over five steps
  bool constrained = false;    // CCVT: seeds stay on the surface, gradients in its tangent planes
  std::string phase;           // for progress
  double done = 0, share = 1;  // of the whole run: fraction before this optimisation, and its own
};

// Moves run.seeds downhill along their places. Afterwards run.energy and run.gradient_norm are theirs. Seeds on the
// surface or inside a solid whose cells are empty are put where the energy is highest. Throws Cancelled between
// evaluations, and Error if a diagram does not cover the domain.
void optimise(CvtRun& run, const OptimiseOptions& options);

// Of the steps, those that are made on a run's own surface where another stands in for it.
inline constexpr double kOnSurfaceShare = 0.15;

// The same, where there is a surface that stands in for the run's first on that, but for the share `on_surface` of the
// steps.
void optimise_with_stand_in(CvtRun& run, Backend* stand_in, OptimiseOptions options,
                            double on_surface = kOnSurfaceShare);

// dF/dx_i = 2 m_i (x_i - c_i) of each seed, and its part along what the seed is held on.
struct CvtGradient {
  std::vector<Vec3> vectors;
  std::vector<Vec3>
      normals;  // of the surface at each seed, to which `vectors` are tangential; empty if not constrained
};

// The gradient at the seeds as they are. Sets run.energy and run.gradient_norm. `constrained` as in OptimiseOptions.
CvtGradient complete(CvtRun& run, bool constrained);

}  // namespace bisector
