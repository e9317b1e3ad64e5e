// Where the points of a branch carry its radius.
#pragma once

#include <vector>

#include "core/geometry.h"
#include "tree/limb.h"

namespace bisector {

// Whether the radius at each point of the limb's axis rests on points. It does where those nearby that the limb owns
// are enough, go round at least a third of the axis, and are off the surface by a small part of the radius, rms: a
// cloud of twigs, whose points fill the tube, is off by a third of it. `noise` is the standard deviation of points off
// thick branches, which thin ones may share.
std::vector<char> supported_radii(const std::vector<Vec3>& points, const Limb& limb, double noise);

// Standard deviation of points off the surface, by their median, where radii rest on points (`fitted`); 0 where none
// do.
double surface_noise(const std::vector<Vec3>& points, const std::vector<Limb>& limbs);

}  // namespace bisector
