// Branch surfaces: tensor-product B-splines swept along an axis with varying radius (thesis 3.4.2, Eq. 3.3).
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"
#include "tree/bspline.h"

namespace bisector {

// A closed surface of circular sections across an axis. Cubic in u (clamped) along the branch: [-1, 0] is the flat disk
// at the base, from its centre outwards, [0, 1] the wall over the axis' parameter, [1, 2] the rounded tip; in [-1, 0]
// and [1, 2] the first and last row are one point. Cubic in v (periodic: the last 3 columns repeat the first 3) around
// the axis from 0 to 1. The normal, the derivative in u times that in v, points outwards. Control point (i, j) is
// control[i * columns + j].
struct BranchSurface {
  BSplineCurve axis;                             // cubic
  std::vector<double> radius_parameters, radii;  // the radius is piecewise linear in the axis' parameter
  std::size_t rows = 0, columns = 0;
  std::vector<double> knots_u, knots_v;  // rows + 4, columns + 4
  std::vector<Vec3> control;

  Vec3 point(double u, double v) const;
  double radius(double t) const;  // of the table, at an axis parameter
};

// The branch whose axis is fitted to `points` (fit_curve) and whose radius runs through `radii`, one for each point;
// none is made less than a hundredth of the largest. Control points lie on regular polygons across the axis in
// rotation-minimising frames, scaled up for the B-spline's shrinking, and as many rows are taken as bring the wall's
// distance from the axis to the radius within 1 %. Where the axis would bend more sharply than a wall of its radius
// can follow without folding over, it is fitted less closely, by up to the radius; where that does not do, the
// radius, and with it the table, is made less. Throws Error as fit_curve does, for numbers of points and radii that
// differ, for radii that are negative or not finite, and if all are 0.
BranchSurface loft_branch(const std::vector<Vec3>& points, const std::vector<double>& radii, double tolerance,
                          std::size_t max_control = 30);

// Triangles of the branch, closed and oriented outwards, with vertices on the surface: as many rings as keep the chord
// error along the branch below `tolerance`, and `sides` vertices on each; 0: as many as keep the chord error around it
// below `tolerance`, from 6 to 48. Throws Error for a tolerance that is not positive and fewer than 3 sides.
TriangleMesh branch_mesh(const BranchSurface& surface, double tolerance, int sides = 0);

}  // namespace bisector
