// Bounds of the Hausdorff distance between two surfaces, from above as well as from below.
#pragma once

#include <vector>

#include "bisector/context.h"
#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

// How far a point of a triangle is from a surface at most: a length between these two, in the mesh's unit.
struct TriangleDistance {
  double lower = 0, upper = 0;
  Vec3 farthest;          // the point that `lower` is of
  Index nearest = kNone;  // the triangle of the surface that is nearest to it
};

// Of each triangle of `from`. The distance to one triangle is convex, so that on a part of another it is largest in a
// corner; parts are divided until the upper bound is at most `enough` or no more than `gap` above the lower one (after
// Tang, Lee and Kim 2009, "Interactive Hausdorff distance computation for general polygonal models", ACM TOG 28(3)).
// Bounds are of the surfaces as given, up to 1e-13 of their size, which is the least gap. Throws Error if `to` has no
// area, a coordinate is not finite or `gap` is not positive; Cancelled.
BISECTOR_API std::vector<TriangleDistance> bound_distances(const TriangleMesh& from, const TriangleMesh& to,
                                                           double enough, double gap, const Context& context = {});

// The two-sided Hausdorff distance, in the mesh's unit: the largest distance of a point of either surface from the
// other lies between these two.
struct HausdorffBounds {
  double lower = 0, upper = 0;
};

// The bounds are at most `gap` apart. Throws as bound_distances() for either mesh.
BISECTOR_API HausdorffBounds bound_hausdorff_distance(const TriangleMesh& mesh, const TriangleMesh& reference,
                                                      double gap, const Context& context = {});

}  // namespace bisector
