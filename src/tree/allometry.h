// Radii where points cannot carry them: the pipe model.
#pragma once

#include <cstddef>
#include <vector>

#include "tree/limb.h"

namespace bisector {

struct PipeModel {
  double exponent = 2.3;     // p: at forks r^p of what comes in is the sum over what goes out (Leonardo: 2)
  double tip_radius = 0;     // of the thinnest twigs' ends, in the limbs' unit
  bool from_points = false;  // the exponent is fitted; else there were too few radii
};

// With r^p proportional to the length of all that grows beyond, so that twigs that a scan does not show are taken to be
// spread evenly, p is fitted to the radii that rest on points, within [2, 3] (Shinozaki et al. 1964; Minamino and
// Tateno 2014). Radii that rest on points stay, others follow from the nearest on the branch or, at its base, from its
// parent's, continuous, falling towards the tip and never above the parent's. A tree of which no radius rests on points
// is as thick as `slenderness`, its size over the radius at the base, says. Limbs come parents first.
PipeModel fill_radii(std::vector<Limb>& limbs, double tip_radius, double slenderness);

}  // namespace bisector
