// How far around a point a surface is a disk.
#pragma once

#include <vector>

#include "core/geometry.h"
#include "mesh/sampling.h"

namespace bisector {

// For each point the largest of the radii 1, 0.8, 0.64, ... times the one given, but no less than `least` times it, for
// which the part of the surface in the ball around the point that is joined to the point in it is a disk: its Euler
// characteristic is 1; or that in a ball half as wide again, where only a bump juts out of the smaller one. A limb of a
// diameter d is one up to about d, a sheet however thin it is. The mesh must be manifold; radii are positive, in its
// unit. Restricted Delaunay triangulations need samples this close (Edelsbrunner and Shah 1997, Triangulating
// topological spaces; Cheng, Dey and Shewchuk 2012, Delaunay Mesh Generation, chapter 13).
std::vector<double> disk_radii(const TriangleMesh& mesh, const std::vector<SurfaceSample>& points,
                               const std::vector<double>& radii, double least);

}  // namespace bisector
