// Generated parts whose surfaces are known: irregular triangles with vertices on planes, spheres, cylinders, cones and
// tori.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry.h"
#include "segment/primitive.h"

namespace bisector::test {

struct CsgModel {
  TriangleMesh mesh;                  // closed, manifold, oriented outward; its vertices on the surfaces but for noise
  std::vector<Primitive> primitives;  // the surfaces, all different
  std::vector<double> areas;          // of the piece of each surface, exact
  std::vector<Index> labels;          // of each triangle: its surface
};

// A block with a domed boss that stands on a fillet, and a blind hole with a chamfer and a tapered end: planes, two
// cylinders of different axes, a sphere, a torus tangent to its neighbours and two cones. About as many triangles as
// asked for. Every vertex is moved along its normal by a Gaussian whose deviation is `noise` times the bounding box's
// diagonal.
CsgModel csg_part(std::size_t triangles, double noise, std::uint64_t random_seed);

// A surface of revolution about a tilted axis: planes, cylinders, a cone, a sphere, and a torus tangent to a cylinder
// and a plane.
CsgModel turned_part(std::size_t triangles, double noise, std::uint64_t random_seed);

// For each surface the region that has most of its triangles, kNone if none has any. Two surfaces may get the same.
std::vector<Index> matching_regions(const CsgModel& model, const std::vector<Index>& labels);

// Share of the triangles that are in the region of their surface, regions that two surfaces got not counting.
double share_right(const CsgModel& model, const std::vector<Index>& labels);

// The largest difference of the parameters of two planes, spheres, cylinders, cones or tori: lengths, and angles in
// radians times `unit_length`. Opposite axes are equal. Infinite if the types differ.
double parameter_difference(const Primitive& a, const Primitive& b, double unit_length);

}  // namespace bisector::test
