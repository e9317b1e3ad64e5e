// Components and sheets of a surface that cross each other, cut along the lines where they do.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// A vertex that was put into a triangle.
struct InsertedVertex {
  Index triangle;
  std::array<double, 3> weights;  // barycentric, of the triangle's corners
};

struct Corefinement {
  // The same surface; its vertices come first, then those that were put in. Labels and face_of_triangle follow.
  TriangleMesh mesh;
  std::vector<InsertedVertex> inserted;      // of each vertex that was put in, of the triangles as they were
  std::vector<std::array<Index, 3>> splits;  // EdgeSplits of the edges that were divided (features/edge_splits.h)
  // Pairs of components, lower one first and ascending, that have areas in common: they were not cut along each other.
  std::vector<std::array<Index, 2>> overlapping;
};

// Cuts triangles of different components, which hang together through vertices, along their common segments, so that
// components only meet in vertices and edges that are at the same points to the bit, up to the rounding of new vertices
// to doubles. Triangles are divided by constrained Delaunay triangulations in exact arithmetic. Two components with
// triangles that lie on each other in a plane are not cut along each other: they would have areas in common still.
// Nothing if no triangles of different components intersect, or more than `most_pairs` do.
std::optional<Corefinement> corefine_components(const TriangleMesh& mesh, std::size_t most_pairs);

// The same for triangles of one component, whose sheets get the same vertices where they cross: edges there have four
// triangles. Pairs that lie on each other in a plane are not cut along each other.
std::optional<Corefinement> corefine_sheets(const TriangleMesh& mesh, std::size_t most_pairs);

// What components have in common.
struct CommonParts {
  std::vector<Index> same;  // of each vertex the first at the same point, kNone if on one component only
  std::vector<std::array<Index, 2>> edges;  // between first vertices, lower one first, ascending
};

// Vertices and edges of different components at the same points, but for edges beside which components have no other
// triangles than common ones, and those that no two have but pairs that are overlapping.
CommonParts find_common_parts(const TriangleMesh& mesh, const std::vector<std::array<Index, 2>>& overlapping = {});

}  // namespace bisector
