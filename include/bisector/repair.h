// Mending triangle meshes: welding cracks, making orientations agree, wrapping what cannot be mended.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/context.h"
#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

struct WeldResult {
  TriangleMesh mesh;
  std::vector<Index> vertex_of;          // of each vertex of the input, the one that it has become
  std::size_t merged_vertices = 0;       // fewer than in the input
  std::size_t split_edges = 0;           // border edges that got vertices of another border
  std::size_t degenerate_triangles = 0;  // removed: two corners are the same vertex
  std::size_t duplicate_triangles = 0;   // removed: of the same three vertices as another, either way round
  std::size_t border_before = 0;         // edges of one triangle in the input
  std::size_t border_after = 0;
};

// First merges vertices at the same point. With a positive tolerance, a length in the mesh's unit, it then merges
// border vertices that are no farther apart, in ascending order of index, each into the nearest of those before it that
// are not merged themselves; nothing moves by more than the tolerance, however many follow each other, and vertices
// keep positions of the input. What is near along the surface too, within twice the tolerance, stays apart, so that
// short edges and thin strips do not collapse; neither do thin sheets, for vertices away from borders stay. Last, a
// border edge is split at vertices of other borders that lie within the tolerance of its inside, if a border runs along
// it there and no triangle turns over.
//
// Of triangles that then have the same three vertices the first of the lowest label is kept; none of two that a surface
// folded onto itself there, out of which they stick, so that it is closed without them.
//
// Vertices and triangles keep their order; labels, face_of_triangle and feature_edges follow, attributes do not. Throws
// Error if the tolerance is negative or not finite.
BISECTOR_API WeldResult weld(const TriangleMesh& mesh, double tolerance);

// Turns triangles over so that neighbours across edges of two triangles run in opposite directions there, wherever that
// can be had; each part that hangs together in this way keeps the orientation of most of its triangles. Every index
// must be below `vertex_count`.
BISECTOR_API void orient(std::vector<Triangle>& triangles, std::size_t vertex_count);

struct WrapResult {
  TriangleMesh mesh;
  double offset = 0;  // of the wrap from the triangles
};

// A closed manifold that does not intersect itself, around whatever triangles there are: their alpha wrap (Portaneri,
// Rouxel-Labbe, Hemmer, Cohen-Steiner and Alliez 2022, "Alpha wrapping with an offset", ACM TOG 41(4)). Seen from
// outside, openings and gaps that a ball of the radius `alpha` does not pass through are closed, and what is behind
// them is filled; cavities without an opening are, too. The result lies a thirtieth of alpha outside of the triangles
// where the ball reaches them; its own edges are up to about alpha long and do not follow sharp edges, which are
// chamfered by as much. Its vertices are new, so labels and feature edges are not kept.
// A sheet that the ball reaches from both sides becomes a shell, two offsets thick. Where there are such, and they
// would be thinner than `thickness`, the whole wrap lies half of that outside. Both are lengths in the mesh's unit;
// alpha is at least a 2000th of the bounding box's diagonal, for time and memory grow with its inverse square. Throws
// Error if it is less, if the thickness is negative or not finite, or if no triangle has an area; Cancelled.
BISECTOR_API WrapResult wrap(const TriangleMesh& mesh, double alpha, double thickness = 0, const Context& context = {});

}  // namespace bisector
