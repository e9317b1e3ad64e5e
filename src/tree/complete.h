// The whole tree from the branches that a fit has found: what points carry of them is kept, the rest is led to where
// there are points, and has radii by the pipe model.
#pragma once

#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "tree/allometry.h"
#include "tree/limb.h"

namespace bisector {

struct CompletionOptions {
  double spacing = 0;        // median distance of a point from its 8th neighbour, in the unit cube
  double tip_radius = 0;     // of the thinnest twigs, in the unit cube
  bool leaves = false;       // are told from wood and left out
  std::vector<Index> group;  // of each point: those of other groups are other trees, those of kNone none; empty: one
};

struct Completion {
  PipeModel pipe;
  std::vector<Index> limb_of;  // of each point; kNone: no branch explains it
  std::vector<char> leaf;      // whether each point is one; empty: leaves were not looked for
};

// `limbs`, parents first, with points, radii and `fitted` (refine_limbs), in the unit cube with z up. Each group has a
// trunk afterwards. The same for any number of threads.
Completion complete_limbs(const std::vector<Vec3>& points, const CompletionOptions& options, std::vector<Limb>& limbs,
                          const Context& context = {});

}  // namespace bisector
