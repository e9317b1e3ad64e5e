// Edges of a mesh that vertices divide, made whole again.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// The vertices along a straight line, from one end to the other. The inner ones are to be taken out.
using VertexChain = std::vector<Index>;

struct WholeEdgesOptions {
  std::vector<std::array<Index, 2>> locked;  // edges that stay, lower vertex first
  std::vector<char> movable;                 // of each vertex, whether it may move or be taken out
  std::function<Vec3(const Vec3&)> project;  // the nearest point of the surface that vertices stay on
};

// Takes the inner vertices of the chains out: the polygon that a vertex's triangles fill is filled anew, with the
// triangulation whose smallest angle is largest and in which none turns over. Where there is none, movable vertices
// that are nearer to the edge than its half length are taken out first. Then edges around are flipped to be Delaunay,
// and movable vertices go to where the smallest angle of their triangles is largest. Vertices that were taken out stay
// in mesh.vertices; labels follow their triangles. Edges that could not be made whole stay divided.
// Last, triangles near the chains with an angle below 30 degrees that two locked edges do not enclose are mended one by
// one: a movable vertex around is taken out, or one is put into an edge or the triangle, if the angles around are
// better once flips and moves have followed. Vertices that are put in come last in mesh.vertices.
void make_whole(TriangleMesh& mesh, const std::vector<VertexChain>& chains, WholeEdgesOptions options);

}  // namespace bisector
