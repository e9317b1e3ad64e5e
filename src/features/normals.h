// Whether a mesh's normals say anything at the scale that it is to be remeshed at (thesis 4.5, "Irregular or noisy
// models").
#pragma once

#include <cstddef>

#include "core/geometry.h"

namespace bisector {

// The roughness of the surface at the scale of a length, in degrees. Around random points of the surface, normals
// within that length, measured along the surface's triangles, are fitted by a linear function of place, which takes
// what the surface bends; the rest is the deviation there, and the median over all points is the roughness. Creases are
// met at few points only, and triangles that are large beside the length have nothing to deviate from, so that neither
// counts. 0 if there is no area. The length must be positive.
double normal_roughness(const TriangleMesh& mesh, double length);

// Whether normals are noise, so that folds are no creases and cells need not be disks. At the edge length that
// `vertices` vertices make on the surface the roughness has to exceed 12 degrees, and it must not be the mere detail of
// a coarse result, which lessens with the length: noise is as rough at half the length, or, where the triangles are too
// large for that, hardly rougher at twice the length.
bool has_noisy_normals(const TriangleMesh& mesh, std::size_t vertices);

}  // namespace bisector
