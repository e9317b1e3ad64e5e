// How near branch surfaces come to the points of a scan.
#pragma once

#include <vector>

#include "bisector/context.h"
#include "bisector/tree.h"
#include "core/geometry.h"

namespace bisector {

struct PointCoverage {
  double distance = 0;   // from the nearest branch surface, on either side of it
  Index branch = kNone;  // that surface's
  double radius = 0;     // of the branch there
};

// Of each point. `mesh` holds the triangles of `surfaces` (branch_mesh), `labels` telling which each belongs to. Exact
// for the mesh; the radius is that at the axis point nearest to the foot, within 1 % of the axis' parameter. Throws
// Error for a mesh without area and labels that are not one per triangle or no surface's, and Cancelled.
std::vector<PointCoverage> cover_points(const std::vector<Vec3>& points, const std::vector<BranchSurface>& surfaces,
                                        const TriangleMesh& mesh, const Context& context = {});

// The share of points, in [0, 1], that are within a distance (in the points' unit), or within so many radii of their
// branch; 0 if there are no points.
double share_within(const std::vector<PointCoverage>& points, double distance);
double share_within_radii(const std::vector<PointCoverage>& points, double radii);

// The share of the mesh's area, in [0, 1], that is farther than a distance from all points (at least one), by 20,000
// samples: what no points show. Throws Error for a mesh without area.
double bare_area(const TriangleMesh& mesh, const std::vector<Vec3>& points, double distance);

}  // namespace bisector
