// The regions of a segmentation as a boundary representation: the loops of border edges that trim each region's
// surface, divided into chains between two regions each.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/export.h"
#include "bisector/mesh.h"
#include "bisector/segment.h"

namespace bisector {

enum class ChainKind {
  sharp,        // the two surfaces meet at an angle
  tangent,      // the two surfaces meet at no more than kTangentAngle
  border,       // of the mesh: one triangle at each edge
  non_manifold  // more than two triangles at each edge, or two that cannot be oriented alike; each side is a chain
};

// In lower case, words joined by '_', as in files.
BISECTOR_API const char* name_of(ChainKind kind);

inline constexpr double kTangentAngle = 10;  // degrees

// A maximal run of border edges with the same regions beside it and no vertex inside where other borders meet it.
struct BorderChain {
  std::vector<Index> vertices;  // of the mesh, in order; a closed chain does not repeat its first
  bool closed = false;          // if not, both ends are on other chains, perhaps at the same vertex
  Index left = kNone;           // region on the left, seen from the side that the mesh's triangles face
  Index right = kNone;  // region on the right, higher than `left`; kNone at a border and where it is non-manifold
  ChainKind kind = ChainKind::border;
  double length = 0;
  // Means over the length, degrees, positive where the surface is convex seen from the side that it faces, 0 without a
  // region on the right: between the normals of the two surfaces, and between those of the two triangles at each edge.
  double surface_angle = 0, mesh_angle = 0;
};

struct ChainUse {
  Index chain = 0;
  bool reversed = false;  // the region is on the chain's right
};

// A closed curve of border edges with the region on the left. Where a region touches itself in a vertex only, the
// vertex counts once for each time.
struct BorderLoop {
  std::vector<ChainUse> chains;
  std::vector<Index> vertices;  // of the chains one after the other; the first is not repeated
  double length = 0;
};

struct RegionOutline {
  // If the region's normals agree with their mean on 99 % of its area, it can be laid flat, and if then one loop alone
  // runs counter-clockwise, that is the outer one and comes first. The others are in descending order of length.
  std::vector<BorderLoop> loops;
  bool has_outer = false;
  // Whether the triangles face where the surface's own normal points: that of a plane, away from the centre of a
  // sphere, from the axis of a cylinder or a cone and from the middle of a torus' tube, along the gradient of a general
  // quadric's polynomial.
  bool same_sense = true;
  long long euler = 0;  // Euler characteristic: 1 for a disk, 0 for a ring, 2 without a border
};

struct RegionBorders {
  std::vector<BorderChain> chains;
  std::vector<RegionOutline> regions;    // of SegmentResult::regions
  std::vector<Triangle> triangles = {};  // of the mesh, oriented alike where that can be had
};

// The borders of a mesh's regions. The vertices may have been moved, as by SegmentOptions::project. Throws Error where
// the labels are not those of the mesh.
BISECTOR_API RegionBorders region_borders(const TriangleMesh& mesh, const SegmentResult& segmentation);

}  // namespace bisector
