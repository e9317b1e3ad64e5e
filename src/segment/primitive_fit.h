// Least squares fits of planes, spheres, circular cylinders, circular cones and tori to weighted points, by orthogonal
// distance (thesis 2.3.3 and 2.5).
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "core/geometry.h"
#include "segment/primitive.h"

namespace bisector {

// Points of a piece of surface, with weights (areas) and unit normals (of triangles around; the sides they point to
// need not agree).
struct SurfaceSamples {
  std::vector<Vec3> points, normals;
  std::vector<double> weights;
};

struct PrimitiveFit {
  Primitive primitive;
  double squared_distance = 0;  // sum of weight times squared exact distance
};

// Fits a surface of the given type (plane, sphere, cylinder, cone or torus), starting from the points and normals
// alone: axes from the lines of the normals (Pottmann and Randrup 1998), then Levenberg-Marquardt. None if the points
// do not determine one, or only one that is larger than 1e3 times their extent, or leaves as much variance as a special
// case of it (a cylinder that is flat over the points, a cone that is a cylinder, a torus that is a sphere). Of cones
// one nappe is fitted, continued beyond the apex. None, too, if the squared distance is above `most`, which is quicker
// to see than that it is a special case. Throws Error for another type, negative weights and numbers that are not
// finite.
std::optional<PrimitiveFit> fit_primitive(SurfaceType type, const SurfaceSamples& samples,
                                          double most = std::numeric_limits<double>::infinity());

// The same from a given start.
std::optional<PrimitiveFit> refine_primitive(const Primitive& start, const SurfaceSamples& samples);

// Orthogonal-distance-like refinement of a general quadric: reweighted algebraic fits (Sampson distance), kept only
// where the sum of weight times squared approximate_distance falls.
PrimitiveFit refine_quadric(const Primitive& start, const SurfaceSamples& samples);

}  // namespace bisector
