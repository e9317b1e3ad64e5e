// What the parts of the segmentation share about the mesh: scaled to unit longest side, with areas and adjacency.
#pragma once

#include <array>
#include <vector>

#include "core/geometry.h"
#include "segment/dual_graph.h"
#include "segment/quadric_fit.h"

namespace bisector {

inline constexpr double kNegligible = 1e-9;  // distance in the unit-sized model that rounding alone may cause

// The points of Eq. 2.3: corners and barycentre, together in memory.
struct TriangleSamples {
  std::array<double, 4> x, y, z;
  double area = 0;
};

struct SegmentDomain {
  std::vector<Vec3> vertices;              // (input - origin) / scale
  std::vector<Triangle> triangles;         // oriented alike where that can be had
  std::vector<Vec3> normals, barycentres;  // of each triangle; a zero normal where there is no area
  std::vector<double> areas;
  std::vector<TriangleSamples> samples;
  std::vector<SurfaceMoments> clusters;  // of a coarsened domain, in place of the triangles', each about its centroid
  double area = 0;
  DualGraph graph;
  std::vector<Index> components;  // of each triangle
  std::size_t component_count = 0;
  Vec3 origin;
  double scale = 1;

  SurfaceMoments moments(Index triangle, const Vec3& about) const {
    if (!clusters.empty()) return moved(clusters[triangle], about);
    const Triangle& t = triangles[triangle];
    return triangle_moments(vertices[t[0]], vertices[t[1]], vertices[t[2]], about);
  }
};

// Throws Error for a mesh without area.
SegmentDomain make_segment_domain(const TriangleMesh& mesh);

}  // namespace bisector
