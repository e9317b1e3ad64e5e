// Axis and radius of a branch by least squares.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

struct Tube {
  std::vector<Vec3> axis;       // from the base to the tip, evenly spaced
  std::vector<double> radii;    // at the axis' points
  std::vector<double> support;  // points that each radius rests on
  double deviation = 0;         // standard deviation of the points off the surface, robustly
};

// The tube, a polyline with a radius that is linear between its points, whose surface the points are nearest to: their
// distances from the axis differ least from the radius, with Tukey's weights against points of other branches, and with
// axis and radius smooth where points are few. `line`, of at least two distinct points, is where the axis starts from.
// The end is moved to the points' end, less a radius for a rounded tip. `noise` is the standard deviation of points off
// the surface: where the radius is not much more, the axis keeps to the middle of the points, as a circle through a
// cloud of noise means nothing. Radii are those of the noisy surface. Few or no points give the line and radii from
// what there is.
Tube fit_tube(const std::vector<Vec3>& points, const std::vector<Vec3>& line, double noise);

// Takes the noise, a standard deviation in each direction, out of radii of noisy surfaces, but for the last third:
// noise feigns no more than the rest.
void remove_noise(double noise, std::vector<double>& radii);

// The non-increasing values nearest to the given ones in the sense of weighted least squares (pool adjacent violators).
std::vector<double> non_increasing(const std::vector<double>& values, const std::vector<double>& weights);

}  // namespace bisector
