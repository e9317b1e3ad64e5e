// Branch surfaces: tensor-product B-splines swept along an axis with varying radius (thesis 3.4.2, Eq. 3.3).
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/tree.h"
#include "core/geometry.h"

namespace bisector {

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
